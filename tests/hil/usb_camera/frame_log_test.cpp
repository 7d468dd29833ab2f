#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "support/temp_dir.hpp"
#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera {
namespace {

FrameRecord record(std::uint64_t number, Outcome outcome) {
  FrameRecord out;
  out.stream = 2;
  out.number = number;
  out.began = {5'000'001'000};
  out.settings = {0.0003, 2.5, 5000};
  out.bytes = 100;
  out.sent = 60;
  out.outcome = outcome;
  return out;
}

TEST(FrameLog, CountsByOutcomeAndKeepsTheLatest) {
  FrameLog log(3);
  for (std::uint64_t n = 0; n < 5; ++n) log.add(record(n, n == 1 ? Outcome::torn : Outcome::sent));
  EXPECT_EQ(log.count(Outcome::sent), 4U);
  EXPECT_EQ(log.count(Outcome::torn), 1U);
  ASSERT_EQ(log.records().size(), 3U);
  EXPECT_EQ(log.records().front().number, 2U);
  log.reset_counts();
  EXPECT_EQ(log.count(Outcome::sent), 0U);
  EXPECT_EQ(log.records().size(), 3U);
}

TEST(FrameLog, WritesALineOfJsonPerFrame) {
  const test::TempDir folder;
  FrameLog log;
  ASSERT_TRUE(log.write_to(folder.path("log")).ok());
  log.add(record(7, Outcome::replaced));
  log.add(record(8, Outcome::sent));
  std::ifstream file(folder.path("log"));
  std::string line;
  ASSERT_TRUE(std::getline(file, line)) << "readable while the program still runs";
  EXPECT_EQ(line, R"({"stream":2,"number":7,"began_ns":5000001000,"pts":5000001,"exposure_s":0.0003,"gain":2.5,)"
                  R"("kelvin":5000,"bytes":100,"sent":60,"outcome":"replaced"})");
  EXPECT_TRUE(std::getline(file, line));
  EXPECT_FALSE(std::getline(file, line));
}

TEST(FrameLog, TheErrorNamesTheFile) {
  FrameLog log;
  const Status status = log.write_to("/nowhere/at/all");
  EXPECT_EQ(status.code(), StatusCode::unavailable);
  EXPECT_NE(status.message().find("/nowhere/at/all"), std::string::npos);
}

TEST(FrameLog, EveryOutcomeHasItsName) {
  EXPECT_EQ(to_string(Outcome::sent), "sent");
  EXPECT_EQ(to_string(Outcome::marked), "marked");
  EXPECT_EQ(to_string(Outcome::aborted), "aborted");
  EXPECT_EQ(static_cast<std::size_t>(Outcome::aborted) + 1, kOutcomes.size());
}

}  // namespace
}  // namespace lightwell::usb_camera
