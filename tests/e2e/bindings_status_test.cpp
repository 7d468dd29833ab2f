// Calibration and recordings of a real probe in each language: the same answers and errors as in C++. The programs
// print what `lines_of_cpp()` returns.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <regex>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/calibration.hpp>

#include "e2e/daemon.hpp"
#include "sim/sensor.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

struct Binding {
  const char* name;
  std::vector<std::string> command;  ///< The URI follows.
  std::vector<std::string> environment;
};

std::vector<Binding> bindings() {
  std::vector<Binding> out = {{"C", {LIGHTWELL_STATUS_C}, {}}};
#ifdef LIGHTWELL_STATUS_PYTHON
  out.push_back({"Python",
                 {LIGHTWELL_PYTHON, "-B", LIGHTWELL_STATUS_PYTHON},
                 {"PYTHONPATH=" LIGHTWELL_PYTHON_PACKAGE, "LIGHTWELL_LIBRARY=" LIGHTWELL_C_LIBRARY}});
#endif
#ifdef LIGHTWELL_STATUS_CSHARP
  out.push_back({"C#", {LIGHTWELL_MONO, LIGHTWELL_STATUS_CSHARP, "--status"}, {"LD_LIBRARY_PATH=" LIGHTWELL_C_FOLDER}});
#endif
  return out;
}

long long micro(double v) { return std::llround(v * 1e6); }

std::string line_of(const std::string& what, const Result<RecordingStatus>& recording) {
  if (!recording.ok())
    return what + " " + std::string(to_string(recording.status().code())) + ": " + recording.status().message() + "\n";
  std::ostringstream out;
  out << what << ' ' << recording->running << ' ' << !recording->file.empty() << ' ' << (recording->bytes > 0) << ' '
      << recording->lost << ' ' << recording->faults << " [" << recording->end_reason << "]\n";
  return out.str();
}

std::string lines_of_calibration(const Result<CalibrationSummary>& c) {
  if (!c.ok()) return "calibration " + std::string(to_string(c.status().code())) + ": " + c.status().message() + "\n";
  std::ostringstream out;
  out << "calibration " << c->id << ' ' << c->absolute << " [" << c->file << "]\n";
  for (std::size_t k = 0; k < c->lenses.size(); ++k) {
    const LensSummary& l = c->lenses[k];
    out << "lens " << l.width << ' ' << l.height << ' ' << l.model << ' ' << micro(l.max_angle_deg) << ' ' << l.response
        << ' ' << l.vignetting << ' ' << l.noise << ' ';
    c->report ? out << micro(c->report->seen_deg[k]) << ' ' << micro(c->report->direction_3_sigma_deg[k]) << '\n'
              : out << "none\n";
  }
  c->report ? out << "report " << c->report->geometry_time_s << ' ' << micro(c->report->rms_px) << ' '
                  << c->report->points << ' ' << c->report->photometry_time_s << '\n'
            : out << "report none\n";
  return out.str();
}

std::string lines_of_cpp(const std::string& uri) {
  Result<Probe> probe = Probe::connect(uri);
  if (!probe.ok()) return probe.status().message();
  std::string out = lines_of_calibration(probe->calibration());
  const std::optional<RecordingStatus> before = probe->info().recording;
  out += before ? line_of("before", *before) : "before none\n";
  out += line_of("start", probe->start_recording());
  out += line_of("again", probe->start_recording());
  out += line_of("stop", probe->stop_recording());
  return out + line_of("stop2", probe->stop_recording());
}

/// Messages name the address and the file, which differ between daemons.
std::string without_names(std::string lines, const std::string& uri) {
  const std::string address = uri.substr(uri.find("://") + 3);
  for (std::size_t at = 0; (at = lines.find(address)) != std::string::npos;) lines.replace(at, address.size(), "PROBE");
  return std::regex_replace(lines, std::regex("[0-9]{8}T[0-9]{6}Z-[0-9]{4}[.]lwr"), "FILE");
}

class BindingsStatusTest : public ::testing::Test {
 protected:
  BindingsStatusTest() {
    write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x());
    std::filesystem::create_directory(folder_.path("recordings"));
  }
  /// Runs C++ and each binding against a fresh daemon with these arguments, because a probe limits how often a
  /// recording starts, and compares.
  void expect_the_same(const std::vector<std::string>& arguments, std::string& cpp) {
    const auto daemon_of = [&] {
      return std::make_unique<Daemon>(
          DaemonOptions{.camera = "sim:" + folder_.path("room.exr") + "?sensor=rgb8", .more = arguments});
    };
    {
      const std::unique_ptr<Daemon> daemon = daemon_of();
      cpp = without_names(lines_of_cpp(daemon->uri()), daemon->uri());
    }
    for (Binding binding : bindings()) {
      SCOPED_TRACE(binding.name);
      const std::unique_ptr<Daemon> daemon = daemon_of();
      binding.command.push_back(daemon->uri());
      Child program(binding.command, {.environment = binding.environment});
      EXPECT_EQ(program.wait(), (ExitStatus{0, 0})) << program.err();
      EXPECT_EQ(without_names(program.out(), daemon->uri()), cpp) << program.err();
    }
  }

  TempDir folder_;
};

TEST_F(BindingsStatusTest, ACalibrationWithAReportAndRecordings) {
  RigParameters rig = *sim::make_rig("pair", 160, 120, PixelFormat::rgb8);
  rig.report = CalibrationReport{1'700'000'000, 0.125, 4321, {88.5, 87.5}, {0.02, 0.03}, 1'700'000'001};
  const std::string file = folder_.write("attic.textproto", calibration_to_text(rig));
  std::string cpp;
  expect_the_same({"--calibration", file, "--recordings", folder_.path("recordings")}, cpp);
  EXPECT_THAT(cpp, HasSubstr("[attic.textproto]\nlens 160 120 kannala_brandt "));
  EXPECT_THAT(cpp, HasSubstr(" srgb 1 1 88500000 20000\n"));
  EXPECT_THAT(cpp, HasSubstr("report 1700000000 125000 4321 1700000001\nbefore 0 0 0 0 0 []\nstart 1 1 "));
  EXPECT_THAT(cpp, HasSubstr("again failed_precondition: PROBE: a recording runs on the probe already: FILE\n"));
  EXPECT_THAT(cpp, HasSubstr("stop2 failed_precondition: "));
}

TEST_F(BindingsStatusTest, NeitherAReportNorAFolder) {
  std::string cpp;
  expect_the_same({}, cpp);
  EXPECT_THAT(cpp, HasSubstr(" none\nreport none\nbefore none\nstart failed_precondition: "));
}

}  // namespace
}  // namespace lightwell::test
