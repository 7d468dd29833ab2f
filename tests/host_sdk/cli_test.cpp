// The tool as used by scripts: exit codes, one-line errors, JSON.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <span>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <lightwell/plane_codec.hpp>
#include <lightwell/recording.hpp>

#include "host_sdk/scenes.hpp"
#include "support/captured_planes.hpp"
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

struct Outcome {
  int code = -1;
  std::string out;  ///< Both streams.
};

Outcome run_program(const std::string& command) {
  Outcome result;
  std::FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return result;
  std::array<char, 4096> buffer{};
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe)) result.out.append(buffer.data(), n);
  const int status = pclose(pipe);
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

Outcome run(const std::string& arguments) { return run_program(std::string(LIGHTWELL_CLI) + " " + arguments); }

long lines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

class Cli : public ::testing::Test {
 protected:
  void SetUp() override {
    Result<RecordWriter> writer = RecordWriter::open(recording(), {RecordingKind::descriptors, "attic", "0.0.2", {}});
    ASSERT_TRUE(writer.ok());
    for (std::uint64_t i = 1; i <= 20; ++i) {
      const auto time = static_cast<std::int64_t>(i) * 10'000'000;
      const std::string bytes = test::encoded(test::numbered(i == 20 ? 25 : i, time));
      ASSERT_TRUE(writer->append(time, test::as_bytes(bytes)).ok());
    }
    ASSERT_TRUE(writer->flush().ok());
  }

  /// Three descriptors and three messages of a plane.
  static void write_planes(const std::string& path) {
    Result<RecordWriter> writer =
        RecordWriter::open(path, {RecordingKind::descriptors_and_planes, "attic", "0.0.2", {}});
    ASSERT_TRUE(writer.ok());
    PlaneEncoder encoder({.images = ImageRecipients::all_clients});
    for (std::uint64_t i = 1; i <= 3; ++i) {
      const auto update = encoder.encode(test::linear_plane(), {0});
      ASSERT_TRUE(update.ok());
      for (const auto& message : *update)
        ASSERT_TRUE(writer->append(static_cast<std::int64_t>(i), message, RecordedMessage::plane).ok());
      const std::string bytes = test::encoded(test::numbered(i, 10'000'000));
      ASSERT_TRUE(writer->append(static_cast<std::int64_t>(i), test::as_bytes(bytes)).ok());
    }
    ASSERT_TRUE(writer->flush().ok());
  }

  [[nodiscard]] std::string recording() const { return folder_.path("recording"); }
  [[nodiscard]] std::string copy() const { return folder_.path("copy"); }

  test::TempDir folder_;
};

TEST_F(Cli, HelpHasExamples) {
  const Outcome help = run("--help");
  EXPECT_EQ(help.code, 0);
  for (const char* word : {"watch", "query", "record", "replay", "info", "config", "doctor", "grpc://", "Exit codes"})
    EXPECT_THAT(help.out, HasSubstr(word));
  for (const char* key : {"latency_p50_ms", "latency_p99_ms", "age_p50_ms", "age_p99_ms", "bytes_p50", "frames_per_s",
                          "gaps", "clock_uncertainty_ms"})
    EXPECT_THAT(run("watch --help").out, HasSubstr(key));
}

TEST_F(Cli, MisuseIsOneLineAndExitCodeTwo) {
  for (const std::string bad :
       {"", "frobnicate", "watch", "watch mqtt://x", "watch grpc://h --seconds no", "query grpc://h",
        "query grpc://h --normal 1,2", "query grpc://h --normal 0,0,0",
        "query grpc://h --direction 0,0,1 --roughness 2", "config", "config get", "config set grpc://h",
        "config set grpc://h band", "config set grpc://h bands=2", "config set grpc://h setting=quick"}) {
    const Outcome result = run(bad);
    EXPECT_EQ(result.code, 2) << bad << ": " << result.out;
    EXPECT_EQ(lines(result.out), 1) << bad << ": " << result.out;
  }
}

TEST_F(Cli, UnreachableIsExitCodeThree) {
  // Port 1 (tcpmux) answers on no machine that runs tests.
  const Outcome result = run("info grpc://127.0.0.1:1");
  EXPECT_EQ(result.code, 3) << result.out;
  EXPECT_EQ(lines(result.out), 1) << result.out;
  EXPECT_THAT(result.out, HasSubstr("lightwelld"));
}

TEST_F(Cli, AConfigurationOfNoProbeIsFourAndOfAnAbsentOneThree) {
  EXPECT_THAT(run("config set --help").out, HasSubstr("NAME=VALUE"));
  EXPECT_EQ(run("config get replay:" + recording()).code, 4);
  const Outcome status = run("recording status replay:" + recording());
  EXPECT_EQ(status.code, 4);
  EXPECT_THAT(status.out, AllOf(HasSubstr("a file of descriptors"), HasSubstr("grpc://HOST:PORT")));
  EXPECT_EQ(run("config set replay:" + recording() + " band=2").code, 4);
  EXPECT_EQ(run("config set grpc://127.0.0.1:1 band=2").code, 3);
}

TEST_F(Cli, MissingFileIsExitCodeFour) {
  EXPECT_EQ(run("replay " + copy()).code, 4);
  EXPECT_EQ(run("info replay:" + copy()).code, 4);
}

TEST_F(Cli, WatchPrintsASummary) {
  const Outcome result = run("watch replay:" + recording() + " --json");
  EXPECT_EQ(result.code, 0) << result.out;
  const std::string summary = result.out.substr(result.out.find("{\"kind\":\"summary\""));
  EXPECT_THAT(summary, HasSubstr("\"frames\":20,"));
  EXPECT_THAT(summary, HasSubstr("\"gaps\":5,"));
  EXPECT_THAT(summary, HasSubstr("\"lights\":1,"));
  EXPECT_THAT(summary, HasSubstr("\"state\":\"ended\""));
  EXPECT_THAT(summary, Not(HasSubstr("null")));
  EXPECT_THAT(run("watch replay:" + recording()).out, HasSubstr("all: "));
}

TEST_F(Cli, WatchWithoutDescriptorsIsExitCodeOne) {
  const std::string empty = folder_.path("empty");
  ASSERT_TRUE(RecordWriter::open(empty, {RecordingKind::descriptors, "x", "0", {}}).ok());
  EXPECT_EQ(run("watch replay:" + empty).code, 1);
  EXPECT_EQ(run("replay " + empty).code, 1);
}

TEST_F(Cli, QueryPrintsResults) {
  const std::string uri = "replay:'" + recording() + "?speed=0'";
  const Outcome result = run("query " + uri + " --normal 0,1,0 --direction=-1,0,0 --roughness 0 --lights --json");
  EXPECT_EQ(result.code, 0) << result.out;
  EXPECT_EQ(lines(result.out), 3) << result.out;
  EXPECT_THAT(result.out, HasSubstr("\"quantity\":\"irradiance\""));
  EXPECT_THAT(result.out, HasSubstr("\"lights\":\"left_out\""));
  EXPECT_THAT(result.out, HasSubstr("\"unit\":\"lux\""));
  EXPECT_THAT(result.out, HasSubstr("\"quantity\":\"light\""));
}

TEST_F(Cli, QueryPrintsWhereAMarkersLightHoldsAndWhereANearLampIs) {
  Descriptor d = test::numbered(1, 10'000'000);
  d.lights[0].distance_m = 0.5F;
  d.lights[0].distance_sigma_m = 0.02F;
  d.lights.push_back(test::light({1, 0, 0}, {0.1F, 0.1F, 0.1F}, 0, 2));
  d.T_probe_origin = {{0, 0, 1, 0}, {0.25, 0, -1}};
  {
    Result<RecordWriter> writer = RecordWriter::open(copy(), {RecordingKind::descriptors, "attic", "0.0.2", {}});
    ASSERT_TRUE(writer.ok());
    const std::string bytes = test::encoded(d);
    ASSERT_TRUE(writer->append(10'000'000, test::as_bytes(bytes)).ok());
  }
  const std::string query = "query 'replay:" + copy() + "?speed=0' --lights";
  const std::string json = run(query + " --json").out, text = run(query).out;
  EXPECT_EQ(lines(json), 3) << json;
  EXPECT_THAT(json, HasSubstr(R"({"quantity":"origin","position":[0.25,0.0,-1.0],"orientation":[0.0,0.0,1.0,0.0]})"));
  // The lamp is towards +Y.
  EXPECT_THAT(json, HasSubstr(R"("distance_m":0.5,)"));
  EXPECT_THAT(json, HasSubstr(R"("position":[0.25,0.5,-1.0])"));
  EXPECT_EQ(json.find("distance_m"), json.rfind("distance_m")) << "of the other light it is not known";
  EXPECT_THAT(text, HasSubstr("origin  position 0.2500 0.0000 -1.0000 m  orientation 0.00000 0.00000 1.00000 0.00000"));
  EXPECT_THAT(text, HasSubstr("distance 0.5 +- 0.02 m  position 0.2500 0.5000 -1.0000 m"));
  EXPECT_THAT(run("query 'replay:" + recording() + "?speed=0' --lights").out, Not(HasSubstr("origin")));
}

TEST_F(Cli, RecordStoresTheReceivedBytes) {
  const Outcome result = run("record 'replay:" + recording() + "?speed=0' " + copy());
  EXPECT_EQ(result.code, 0) << result.out;
  Result<RecordReader> a = RecordReader::open(recording()), b = RecordReader::open(copy());
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(b->header().probe_name, "attic");
  Record x, y;
  while (a->next(x)) {
    ASSERT_TRUE(b->next(y));
    EXPECT_EQ(x.payload, y.payload);
  }
  EXPECT_FALSE(b->next(y));
}

std::string hex(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte b : bytes) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", std::to_integer<unsigned>(b));
    text += digits.data();
  }
  return text;
}

TEST_F(Cli, RecordWritesMcapThatIsReadByItsOwnSchema) {
  const std::string planes = copy() + ".planes", file = copy() + ".mcap";
  write_planes(planes);
  ASSERT_EQ(run("record 'replay:" + planes + "?speed=0' " + file + " --plane --mcap").code, 0);
  const Outcome messages = run_program(PYTHON " " MCAP_MESSAGES " " + file);
  ASSERT_EQ(messages.code, 0) << messages.out;
  // The bytes and the order of each kind are those of the recording.
  Result<RecordReader> reader = RecordReader::open(planes);
  ASSERT_TRUE(reader.ok());
  Record record;
  std::size_t at_descriptor = 0, at_plane = 0;
  while (reader->next(record)) {
    std::size_t& at = record.message == RecordedMessage::plane ? at_plane : at_descriptor;
    at = messages.out.find("\"bytes\": \"" + hex(record.payload) + "\"", at);
    ASSERT_NE(at, std::string::npos);
    ++at;
  }
  EXPECT_EQ(lines(messages.out), 6) << messages.out;
  EXPECT_THAT(messages.out,
              HasSubstr(R"("topic": "lightwell/descriptor", "schema": "lightwell.v1.LightingDescriptor")"));
  EXPECT_THAT(messages.out, HasSubstr(R"("topic": "lightwell/plane", "schema": "lightwell.v1.PlaneUpdate")"));
  EXPECT_THAT(messages.out, HasSubstr(R"("sequence": "3")")) << "decoded by the file's schema";
}

TEST_F(Cli, RecordRefusesToContinueAnMcapFile) {
  const std::string file = copy() + ".mcap", record = "record 'replay:" + recording() + "?speed=0' " + file + " --mcap";
  ASSERT_EQ(run(record).code, 0);
  const std::string before = test::read_file(file);
  const Outcome again = run(record);
  EXPECT_EQ(again.code, 4);
  EXPECT_THAT(again.out, HasSubstr("choose another name"));
  EXPECT_EQ(test::read_file(file), before);
  const Outcome full = run("record 'replay:" + recording() + "?speed=0' /dev/full --mcap");
  EXPECT_EQ(full.code, 4);
  EXPECT_THAT(full.out, HasSubstr("No space left")) << full.out;
}

TEST_F(Cli, RecordStoresPlanesOnRequest) {
  const std::string planes = copy() + ".planes", again = copy() + ".again", without = copy() + ".without";
  write_planes(planes);
  const Outcome result = run("record 'replay:" + planes + "?speed=0' " + again + " --plane");
  EXPECT_EQ(result.code, 0) << result.out;
  EXPECT_THAT(result.out, HasSubstr("3 descriptors"));
  EXPECT_THAT(result.out, HasSubstr("3 messages of planes"));
  Result<RecordReader> a = RecordReader::open(planes), b = RecordReader::open(again);
  ASSERT_TRUE(a.ok() && b.ok());
  Record x, y;
  while (a->next(x)) {
    ASSERT_TRUE(b->next(y));
    EXPECT_EQ(x.payload, y.payload);
    EXPECT_EQ(x.message, y.message);
  }
  EXPECT_FALSE(b->next(y));
  const Outcome text = run("replay " + again), json = run("replay " + again + " --json");
  EXPECT_EQ(text.code, 0) << text.out;
  EXPECT_EQ(lines(text.out), 6) << text.out;
  EXPECT_THAT(text.out, HasSubstr("plane 00c0ffee"));
  EXPECT_THAT(text.out, HasSubstr("revision 1  tiles 6 of 6  texture 64"));
  EXPECT_THAT(json.out, HasSubstr(R"("plane":{"capture":12648430,"revision":3,"tiles":0,"texture_edge":64})"));

  EXPECT_EQ(run("record 'replay:" + planes + "?speed=0' " + without).code, 0);
  Result<RecordReader> c = RecordReader::open(without);
  ASSERT_TRUE(c.ok());
  EXPECT_EQ(c->header().kind, RecordingKind::descriptors);
  // A recording of another kind is not continued.
  EXPECT_NE(run("record 'replay:" + planes + "?speed=0' " + without + " --plane").code, 0);
}

TEST_F(Cli, ReplayListsDescriptors) {
  EXPECT_EQ(lines(run("replay " + recording()).out), 20);
  const Outcome json = run("replay " + recording() + " --json");
  EXPECT_EQ(json.code, 0);
  EXPECT_EQ(lines(json.out), 20) << json.out;
  EXPECT_THAT(json.out, HasSubstr("\"sequence\":\"25\""));
}

TEST_F(Cli, WhatAProbeSaysOfItselfCommandsNoTerminalAndForgesNoLine) {
  {
    Result<RecordWriter> writer =
        RecordWriter::open(copy(), {RecordingKind::descriptors, "attic\nfirmware     9.9", "0.0.2\x1b[2J\u202E", {}});
    ASSERT_TRUE(writer.ok());
    const std::string bytes = test::encoded(test::numbered(1, 10'000'000));
    ASSERT_TRUE(writer->append(10'000'000, test::as_bytes(bytes)).ok());
  }
  const std::string uri = "'replay:" + copy() + "?speed=0'";
  const std::string text = run("info " + uri).out, json = run("info " + uri + " --json").out;
  EXPECT_THAT(text, HasSubstr("name         attic\\x0afirmware     9.9 ("));
  EXPECT_THAT(text, HasSubstr("0.0.2\\x1b[2J\\xe2\\x80\\xae\n"));
  EXPECT_THAT(json, HasSubstr(R"("name":"attic\nfirmware     9.9")"));
  EXPECT_THAT(json, HasSubstr(R"("version":"0.0.2\u001b[2J\u202e")"));
}

TEST_F(Cli, InfoReportsTheEnvironmentMap) {
  const std::string uri = "'replay:" + recording() + "?speed=0'";
  EXPECT_THAT(run("info " + uri).out, HasSubstr("no map"));
  EXPECT_THAT(run("info " + uri + " --json").out, HasSubstr("\"environment_edge\":0,"));
  EXPECT_THAT(run("query " + uri + " --direction 0,1,0 --json").out, HasSubstr("\"source\":\"harmonics\""));
  EnvironmentMap map;
  map.levels = {{16, 0}, {8, 1}};
  map.key_interval_ms = 60'000;
  map.texels.assign(texel_count(map.levels), 0x80000001U);
  map.key = environment_key(map);
  {
    Result<RecordWriter> writer = RecordWriter::open(copy(), {RecordingKind::descriptors, "attic", "0.0.2", {}});
    ASSERT_TRUE(writer.ok());
    for (std::uint64_t i = 1; i <= 5; ++i) {
      Descriptor d = test::numbered(i, static_cast<std::int64_t>(i) * 10'000'000);
      if (i == 2) d.environment = map;
      const std::string bytes = test::encoded(d);
      ASSERT_TRUE(writer->append(d.time.mid_exposure.ns, test::as_bytes(bytes)).ok());
    }
    ASSERT_TRUE(writer->flush().ok());
  }
  const std::string mapped = "'replay:" + copy() + "?speed=0'";
  EXPECT_THAT(run("info " + mapped).out, HasSubstr("environment  16x16, 2 levels"));
  EXPECT_THAT(run("info " + mapped + " --json").out, HasSubstr("\"environment_edge\":16,"));
  const Outcome query = run("query " + mapped + " --direction 0,1,0 --roughness 0 --json");
  EXPECT_THAT(query.out, HasSubstr("\"source\":\"map\""));
  EXPECT_THAT(run("query " + mapped + " --direction 0,1,0").out, HasSubstr("from map"));
}

TEST_F(Cli, InfoReportsIdentity) {
  const Outcome json = run("info replay:" + recording() + " --json");
  EXPECT_EQ(json.code, 0);
  EXPECT_THAT(json.out, HasSubstr("\"name\":\"attic\""));
  EXPECT_THAT(json.out, HasSubstr("\"recording\":null"));
  const Outcome text = run("info replay:" + recording());
  EXPECT_EQ(text.code, 0);
  EXPECT_THAT(text.out,
              AllOf(HasSubstr("frames of the camera by lightwelld --record"), HasSubstr("clients cannot record")));
}

}  // namespace
}  // namespace lightwell
