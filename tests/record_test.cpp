#include "tuner/results/record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tests/full_record.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(Record, EveryFieldRoundTrips) {
  const Record record = full_record();
  const json j = record;
  const auto back = json::parse(j.dump()).get<Record>();
  EXPECT_EQ(json(back), j);
  EXPECT_EQ(back.case_id, record.case_id);
  EXPECT_EQ(back.params, record.params);  // in the order of the case id, not of the alphabet
  EXPECT_EQ(back.status, Status::ok);
  EXPECT_EQ(back.frame_time->summary.ci_high, record.frame_time->summary.ci_high);
  EXPECT_EQ(back.frame_time->timer, "gl_timestamp");
  EXPECT_EQ(back.error, record.error);
  EXPECT_EQ(back.memory_bytes, record.memory_bytes);
  EXPECT_EQ(back.reference_key, record.reference_key);
}

TEST(Record, LayoutOfTheErrorIsTheDocumentedOne) {
  const json j = full_record();
  EXPECT_EQ(j["error"]["e_xy"]["p99"], 4.0 / 64);
  EXPECT_EQ(j["error"]["taps"]["max"], 29.0 / 64);
  EXPECT_EQ(j["error"]["missed_rate"], 11.0 / 64);
  EXPECT_EQ(j["frame_time_ns"]["n"], 7);
  EXPECT_EQ(j["params"]["linear_steps"], "16");
}

TEST(Record, IdenticalPicturesHaveANullPsnr) {
  Record record = full_record();
  (*record.error)["psnr"] = std::nullopt;
  json j = record;
  EXPECT_TRUE(j["error"]["psnr"].is_null());
  EXPECT_FALSE(j.get<Record>().error->values[find_metric("psnr").place].has_value());
  j["error"].erase("psnr");  // null says something; absence would not
  EXPECT_THAT([&] { (void)j.get<Record>(); }, ThrowsMessage<Error>(HasSubstr("'psnr' is missing")));
}

// The error of a line of results.jsonl as the suite has always written it, to the byte.
TEST(Record, AnErrorOfOldIsReadAndWrittenAsItWas) {
  const std::string error =
      R"({"e_xy":{"max":9.5,"mean":0.1,"p50":0.05,"p95":0.3,"p99":0.5},)"
      R"("e_z":{"max":0.9,"mean":0.01,"p50":0.005,"p95":0.03,"p99":0.06},"flicker":null,"flip":0.125,)"
      R"("inside_rate":0.002,"missed_rate":0.001,"pixels":65536,"psnr":38.5,"ssim":0.75,)"
      R"("taps":{"max":30.0,"mean":12.5},"unconverged_rate":0.003})";
  json line = full_record();
  line["error"] = json::parse(error);
  EXPECT_EQ(json(line.get<Record>())["error"].dump(), error);
}

// A metric that is newer than the file is unmeasured there; whatever else is missing is an error.
TEST(Record, WhatNobodyMeasuredMayBeAbsent) {
  for (const MetricRow& row : metrics()) {
    json j = full_record();
    (row.part.empty() ? j["error"] : j["error"][std::string(row.metric->id)])
        .erase(std::string(row.part.empty() ? row.id : row.part));
    if (row.metric->no_value == NoValue::unmeasured)
      EXPECT_FALSE(row.value(*j.get<Record>().error).has_value()) << row.id;
    else
      EXPECT_THROW((void)j.get<Record>(), Error) << row.id;
  }
}

TEST(Record, AFailedCaseHasNoTimesAndMayLackThem) {
  Record record = full_record();
  record.status = Status::timeout;
  record.reason = "a frame took 21 s";
  record.frame_time.reset();
  record.error.reset();
  json j = record;
  EXPECT_FALSE(j.contains("frame_time_ns"));
  EXPECT_FALSE(j.contains("error"));
  EXPECT_EQ(j.get<Record>().reason, "a frame took 21 s");
  j["frame_time_ns"] = nullptr;
  EXPECT_FALSE(j.get<Record>().frame_time.has_value());
  j["status"] = "ok";
  EXPECT_THAT([&] { (void)j.get<Record>(); }, ThrowsMessage<Error>(HasSubstr("status is ok")));
}

TEST(Record, NotANumberNeverReachesAFile) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    const auto refused = [bad](double& (*field)(Record&)) {
      Record record = full_record();
      field(record) = bad;
      EXPECT_THROW((void)json(record), Error);
    };
    refused([](Record& r) -> double& { return r.frame_time->summary.median; });
    refused([](Record& r) -> double& { return r.frame_time->summary.mad; });
    refused([](Record& r) -> double& { return r.frame_time->summary.ci_low; });
    refused([](Record& r) -> double& { return r.frame_time->summary.ci_high; });
    refused([](Record& r) -> double& { return r.frame_time->raw_median; });
    for (const MetricRow& row : metrics()) {
      Record record = full_record();
      record.error->values.at(row.place) = bad;
      EXPECT_THROW((void)json(record), Error) << row.id;
    }
    refused([](Record& r) -> double& { return r.bake_time_ns; });
    refused([](Record& r) -> double& { return *r.device_bake_ns; });
    refused([](Record& r) -> double& { return *r.first_draw_ns; });
    EXPECT_THROW((void)json(Sample{.case_id = "c", .frame_time_ns = bad}), Error);
    EXPECT_THROW((void)json(Sample{.case_id = "c", .at_ns = bad}), Error);
  }
}

// Whatever key is missing or of another type: an Error that names it.
TEST(Record, EveryMissingOrWrongFieldIsNamed) {
  const json whole = full_record();
  for (const auto& item : whole.items()) {
    json without = whole;
    without.erase(item.key());
    if (item.key() == "reason" || item.key() == "device_bake_ns" || item.key() == "first_draw_ns")
      EXPECT_EQ(json(without.get<Record>()), without) << "absent means none";
    else
      EXPECT_THAT([&] { (void)without.get<Record>(); }, ThrowsMessage<Error>(HasSubstr("'" + item.key() + "'")));
    json wrong = whole;
    wrong[item.key()] = json::array({1});
    EXPECT_THROW((void)wrong.get<Record>(), Error) << item.key();
  }
  EXPECT_THROW((void)json(3).get<Record>(), Error);
  EXPECT_THROW((void)json::object().get<Sample>(), Error);
}

TEST(Record, StatusIdsRoundTrip) {
  for (const Status status :
       {Status::ok, Status::unsupported, Status::compile_error, Status::timeout, Status::device_lost,
        Status::out_of_memory, Status::invalid_timer, Status::throttled, Status::crashed})
    EXPECT_EQ(parse_status(status_id(status)), status);
  EXPECT_EQ(status_id(Status::throttled), "throttled");
  EXPECT_THROW((void)parse_status("fine"), Error);
  EXPECT_THROW((void)parse_status("skipped"), Error);  // which nothing ever produced
}

RC_GTEST_PROP(Sample, RoundTripsToTheBit, (std::string case_id, int round, int frames)) {
  const auto number = [] {
    return *rc::gen::suchThat(rc::gen::arbitrary<double>(), [](double d) { return std::isfinite(d); });
  };
  std::erase_if(case_id, [](char c) { return (static_cast<unsigned char>(c) & 0x80U) != 0; });
  const double time_ns =
      *rc::gen::suchThat(rc::gen::arbitrary<double>(), [](double d) { return std::isfinite(d) && d > 0; });
  const Sample sample{
      .case_id = case_id, .round = round, .frames = frames, .frame_time_ns = time_ns, .at_ns = number()};
  const auto back = json::parse(json(sample).dump()).get<Sample>();
  RC_ASSERT(back.case_id == sample.case_id);
  RC_ASSERT(back.round == sample.round && back.frames == sample.frames);
  RC_ASSERT(back.frame_time_ns == sample.frame_time_ns && back.at_ns == sample.at_ns);
}

// A ratio of such times means nothing, and a timer that says so lies.
TEST(Sample, takes_only_times_that_can_be) {
  const json whole = Sample{.case_id = "c", .frames = 1, .frame_time_ns = 5, .at_ns = 1};
  for (const double bad : {0.0, -1.0}) {
    EXPECT_THROW((void)json(Sample{.case_id = "c", .frame_time_ns = bad}), Error);
    json line = whole;
    line["frame_time_ns"] = bad;
    EXPECT_THAT([&] { (void)line.get<Sample>(); }, ThrowsMessage<Error>(HasSubstr("'frame_time_ns' is ")));
  }
}

TEST(Record, takes_only_times_that_can_be_and_the_backend_of_its_id) {
  const json whole = full_record();
  for (const char* key : {"median", "ci_low", "ci_high", "raw_median"})
    for (const double bad : {0.0, -1.0}) {
      json line = whole;
      line["frame_time_ns"][key] = bad;
      EXPECT_THAT([&] { (void)line.get<Record>(); }, ThrowsMessage<Error>(HasSubstr(key)));
    }
  json line = whole;
  line["frame_time_ns"]["n"] = 0;
  EXPECT_THROW((void)line.get<Record>(), Error);
  line = whole;
  line["case"] = "relief@rocks/top?linear_steps=4&backend=metal";
  EXPECT_THAT([&] { (void)line.get<Record>(); }, ThrowsMessage<Error>(HasSubstr("the case's id says 'metal'")));
}

}  // namespace
}  // namespace reliefbench
