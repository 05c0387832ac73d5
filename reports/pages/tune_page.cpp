#include "reports/pages/tune_page.h"

#include <nlohmann/json.hpp>

#include "kernels/base/atomic_file.h"
#include "reports/pages/template.h"

namespace reliefbench {

void write_tune_page(const TuneResult& result, const std::filesystem::path& folder) {
  write_atomically(folder / kTunePage, fill_page(kTunePage, tune_json(result)));
}

}  // namespace reliefbench
