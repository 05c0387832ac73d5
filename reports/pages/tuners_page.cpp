#include "reports/pages/tuners_page.h"

#include "kernels/base/atomic_file.h"
#include "reports/pages/template.h"

namespace reliefbench {

void write_tuners_page(const TunerComparison& comparison, const std::filesystem::path& path) {
  write_output(path, fill_page("tuners.html", tuners_json(comparison)));
}

}  // namespace reliefbench
