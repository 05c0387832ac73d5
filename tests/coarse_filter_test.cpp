// Errors that a device's coarse sampler made are marked, in the table, on the pages and at the pick.
#include "tuner/results/coarse_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "kernels/base/append_file.h"
#include "reports/pages/report_data.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/schema.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/run_files.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

/// The audit of a device that filters 8-bit texels as llvmpipe does, and others as a GPU.
nlohmann::json llvmpipes_filter() {
  const auto row = [](std::string_view texels, double worst) {
    return nlohmann::json{{"texels", texels}, {"bits", 8},         {"rounds", true},
                          {"least", -worst},  {"greatest", worst}, {"value", 0}};
  };
  return {row("unorm8", 0.0039), row("unorm16", 0.00196)};
}

nlohmann::json info_of(const nlohmann::json& filter) {
  return {{"devices", {{{"backend", "opengl"}, {"name", "llvmpipe"}, {"filter", filter}}}}};
}

TEST(CoarseFilter, is_seen_by_settings_that_read_such_texels_with_it) {
  const CoarseFilter filter(info_of(llvmpipes_filter()), "opengl");
  EXPECT_TRUE(filter.made_error_of(parse_setting("cone?format=rg8")));
  EXPECT_TRUE(filter.made_error_of(parse_setting("relief")));  // r8
  EXPECT_FALSE(filter.made_error_of(parse_setting("cone?format=rg8&filter=manual")));
  EXPECT_FALSE(filter.made_error_of(parse_setting("cone?format=rg16")));
  EXPECT_FALSE(filter.made_error_of(parse_setting("flat")));
  EXPECT_FALSE(filter.made_error_of(parse_setting("max_mip?format=r8")));  // has no filter
  EXPECT_EQ(filter.mark("relief@rocks/grazing?format=r8&backend=opengl"), CoarseFilter::kMark);
  EXPECT_THAT(filter.note(), HasSubstr("llvmpipe"));
  EXPECT_THAT(filter.note(), HasSubstr("unorm8 texels"));
  EXPECT_THAT(filter.note(), HasSubstr("0.0039"));
}

TEST(CoarseFilter, is_none_where_nothing_is_known_of_it) {
  for (const CoarseFilter& filter :
       {CoarseFilter(), CoarseFilter(info_of(llvmpipes_filter()), "vulkan"),
        CoarseFilter(info_of(nlohmann::json::array()), "opengl"), CoarseFilter(nlohmann::json::object(), "opengl")}) {
    EXPECT_EQ(filter.note(), "");
    EXPECT_EQ(filter.mark("relief"), "");
  }
}

/// A sweep on the null backend, whose device then says that it filters coarsely.
class CoarselyFilteredRun : public ::testing::Test {
 protected:
  void SetUp() override {
    run_ = null_sweep(folder_);
    nlohmann::json info = nlohmann::json::parse(read_file(run_ / kRunFile));
    info["devices"][0]["filter"] = llvmpipes_filter();
    EXPECT_EQ(schema_errors(info, "run"), "");
    std::ofstream(run_ / kRunFile) << info.dump(1);
  }
  TempFolder folder_;
  std::filesystem::path run_;
};

TEST_F(CoarselyFilteredRun, is_marked_at_the_pick) {
  const CommandResult pick = run_reliefbench({"recommend", run_, "--max-time-ms", "1000"}, folder_.path());
  EXPECT_THAT(pick.out, HasSubstr(" *\n"));
  EXPECT_THAT(pick.out, HasSubstr("* filter=hardware on null (null), whose"));
  const CommandResult json = run_reliefbench({"recommend", run_, "--json", "--max-time-ms", "1000"}, folder_.path());
  EXPECT_THAT(nlohmann::json::parse(json.out).at("answers").at(0).at("filter_note").get<std::string>(),
              HasSubstr("expect less error on a GPU"));
}

TEST_F(CoarselyFilteredRun, is_marked_on_the_page) {
  const reliefbench::Run run = load_run(run_);
  const nlohmann::json data = report_data(std::span(&run, 1)).data;
  EXPECT_EQ(data.at("runs").at(0).at("filter_notes").size(), 1U);
  int marked = 0;
  for (const nlohmann::json& point : data.at("points")) {
    const Settings settings = parse_setting(point.at("id").get<std::string>());
    const bool is_8_bit = settings.technique().reads_map() && storage_of(settings).format.type == TexelType::unorm8;
    EXPECT_EQ(point.at("mark") == CoarseFilter::kMark, is_8_bit && settings.is("filter", "hardware"));
    marked += point.at("mark") == "" ? 0 : 1;
  }
  EXPECT_GT(marked, 0);
}

TEST_F(CoarselyFilteredRun, is_marked_by_a_search_of_it) {
  TuneOptions options;
  options.quiet = true;
  const nlohmann::json found = tune_json(replay_tune(run_, "", options));
  EXPECT_EQ(schema_errors(found, "tune"), "");
  EXPECT_THAT(found.at("filter").at("note").get<std::string>(), HasSubstr("unorm8"));
  EXPECT_GT(found.at("filter").at("marked").size(), 0U);
  EXPECT_LT(found.at("filter").at("marked").size(), found.at("settings").size());
}

}  // namespace
}  // namespace reliefbench
