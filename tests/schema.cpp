#include "tests/schema.h"

#include <fmt/format.h>

#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "kernels/base/append_file.h"

namespace reliefbench {

nlohmann::json load_schema(std::string_view name) {
  return nlohmann::json::parse(
      read_file(fmt::format("{}/configs/schema/{}.schema.json", RELIEFBENCH_SOURCE_DIR, name)));
}

std::string schema_errors(const nlohmann::json& document, std::string_view schema_name) {
  const nlohmann::json text = load_schema(schema_name);
  valijson::Schema schema;
  valijson::SchemaParser().populateSchema(valijson::adapters::NlohmannJsonAdapter(text), schema);
  valijson::ValidationResults results;
  valijson::Validator validator;
  validator.validate(schema, valijson::adapters::NlohmannJsonAdapter(document), &results);
  std::string errors;
  for (valijson::ValidationResults::Error error; results.popError(error);) {
    for (const std::string& part : error.context) errors += part;
    errors += ": " + error.description + "\n";
  }
  return errors;
}

}  // namespace reliefbench
