#include "tuner/cli/features_option.h"

#include "kernels/base/error.h"
#include "tuner/plan/setting_space.h"
#include "tuner/plan/wanted_features.h"

namespace reliefbench {

void add_features_option(CLI::App& command, std::string& features) {
  const std::string words =
      "only settings that show all of these, as `require` names them, e.g. shadow,penumbra or shadow=cone; see `list "
      "features`";
  command.add_option("--features", features, words)->type_name("LIST");
}

void keep_features(std::vector<Record>& records, const std::string& features, const std::string& run) {
  const std::vector<WantedFeature> wanted = parse_wanted_features(features);
  std::erase_if(records, [&](const Record& record) { return !shows(parse_setting(record.case_id), wanted); });
  if (records.empty()) fail_input("--features {}: no setting in {} shows that", features, run);
}

}  // namespace reliefbench
