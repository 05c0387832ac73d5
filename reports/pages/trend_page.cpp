#include "reports/pages/trend_page.h"

#include "reports/pages/template.h"

namespace reliefbench {

std::string trend_page(const nlohmann::json& data) { return fill_page("trend.html", data); }

}  // namespace reliefbench
