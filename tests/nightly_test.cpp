// Forty nights of the null device, from the command line: what a team would run, on both kinds of database.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/command.h"
#include "tests/history_rig.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::SizeIs;

class NightlyTest : public testing::TestWithParam<const char*> {};

}  // namespace
}  // namespace reliefbench
