// A day of a panorama estimator: cached frames are replayed through one estimator whose configuration changes every
// kPhaseFrames frames, through all settings in turn, again and again; time stamps advance so that the frames are a day.
//   measure_million [--frames N]     frames [1000000], rounded up to whole rounds of all configurations, at least three
// Two lenses of 160x120, RGB8 with noise, single frames and brackets of three in turn. The scene: a smooth room; the
// brightest lamp and a second one always shine, a third one moves by up to a degree a frame, a fourth one is switched.
// Prints, for tests/figures:
//   million.frames, rounds, refused, flagged
//   million.unsound         descriptors with a value that is not finite, or that cannot be sent
//   million.drift           the largest RMS difference between the irradiance of a descriptor of the last round and of
//                           the same frame in the second, relative to its RMS; of the last cycle of each configuration.
//                           In the first round the first configuration has none before it, whose choice of lights and
//                           bands the optimizer prefers to keep
//   million.growth_kb       growth of the resident memory from the end of the second round to its largest value
//   million.tracks.LAMP     track numbers of brightest and second in all descriptors that hold them
//   million.swaps.LAMP      changes of the number between successive descriptors that both hold the lamp
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <numbers>
#include <unistd.h>
#include <vector>

#include <lightwell/query.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "firmware/estimate/extremes/judge.hpp"
#include "measure/output.hpp"
#include "measure/shots.hpp"
#include "reference/vector.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
namespace ref = reference;
using measure::print_figure;

constexpr int kCycleFrames = 64, kPhaseFrames = 8 * kCycleFrames, kNormals = 64;
constexpr std::int64_t kReferenceRound = 1;  // From 0.
constexpr double kDay_s = 86400, kDeg = std::numbers::pi / 180;
/// A light within this angle of a lamp is that lamp's.
constexpr double kLampRadius_deg = 4;

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_million: %s\n", what.c_str());
  std::exit(1);
}

double resident_kb() {
  std::ifstream statm("/proc/self/statm");
  double pages = 0, resident = 0;
  statm >> pages >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1024;
}

struct Phase {
  EstimatorConfig config;
  int exposures;
};
std::vector<Phase> phases() {
  std::vector<Phase> out;
  for (const int exposures : {1, 3})
    for (const Setting setting : kSettings)
      for (const int interleave : {1, 4, kMaxInterleave})
        for (const int max_bytes : {0, 128})
          for (const Smoothing smoothing : {Smoothing::one_euro, Smoothing::none}) {
            Phase phase{{}, exposures};
            phase.config.setting = setting;
            phase.config.panorama.interleave = interleave;
            phase.config.panorama.max_bytes = max_bytes;
            phase.config.panorama.smoothing = smoothing;
            out.push_back(phase);
          }
  return out;
}

/// Lamps of the scene, in the order of the program's comment.
enum Lamp : std::size_t { brightest, second, moving };
constexpr const char* kLampNames[] = {"brightest", "second", "moving"};

Vec3d direction_of(Lamp lamp, int frame) {
  const double turn = 2 * std::numbers::pi * frame / kCycleFrames;
  if (lamp == brightest) return normalized(Vec3d{0.3, 0.8, -0.5});
  if (lamp == second) return normalized(Vec3d{-0.8, 0.4, 0.3});
  return rotate(Quat::about({0, 1, 0}, 10 * kDeg * std::sin(turn)), normalized(Vec3d{0.5, -0.2, 0.8}));
}

/// The frames of a cycle, in one exposure or in three.
std::vector<measure::Shot> shots_of(const extremes::RigRenderer& renderer, const measure::Camera& camera,
                                    int exposures) {
  extremes::Chance chance(24);
  const extremes::Scene room = extremes::room(chance, 0);
  std::vector<measure::LensRadiance> pictures;
  double peak = 0, mean = 0;
  for (int i = 0; i < kCycleFrames; ++i) {
    extremes::Scene scene = room;
    scene.discs.push_back({direction_of(brightest, i), 3 * kDeg, {400, 380, 330}});
    scene.discs.push_back({direction_of(second, i), 3 * kDeg, {200, 210, 250}});
    scene.discs.push_back({direction_of(moving, i), 4 * kDeg, {100, 80, 60}});
    if (i % 32 >= 16) scene.discs.push_back({normalized(Vec3d{-0.3, -0.7, -0.6}), 3 * kDeg, {150, 150, 150}});
    pictures.push_back(renderer.render(scene));
    peak = std::max(peak, measure::peak_of(pictures.back()));
    mean = std::max(mean, measure::mean_of(pictures.back()));
  }
  std::vector<double> times = camera.bracket_of_three(peak, mean);
  times.resize(static_cast<std::size_t>(exposures));
  std::vector<measure::Shot> out;
  for (const measure::LensRadiance& picture : pictures) out.push_back(camera.expose(picture, times, out.size()));
  return out;
}

using IrradianceSamples = std::array<Irradiance, kNormals>;

IrradianceSamples irradiance_of(const Descriptor& d, const std::vector<ref::V3>& normals) {
  IrradianceSamples out;
  for (std::size_t n = 0; n < normals.size(); ++n)
    out[n] = irradiance_at(d, vec_cast<float>(Vec3d{normals[n].x, normals[n].y, normals[n].z}));
  return out;
}

/// RMS of the difference, relative to that of `a`.
double difference(const IrradianceSamples& a, const IrradianceSamples& b) {
  double squares = 0, difference = 0;
  for (std::size_t n = 0; n < a.size(); ++n)
    for (int c = 0; c < 3; ++c) {
      squares += static_cast<double>(a[n][c]) * a[n][c];
      difference += (static_cast<double>(a[n][c]) - b[n][c]) * (static_cast<double>(a[n][c]) - b[n][c]);
    }
  return std::sqrt(difference / squares);
}

/// The track numbers of a lamp.
struct Tracks {
  std::vector<std::uint32_t> all;
  std::uint32_t last = 0;  ///< In the last descriptor; 0: it does not hold the lamp.
  int swaps = 0;

  void add(const Descriptor& d, Vec3d lamp) {
    const auto closeness = [&](const Light& l) { return dot(vec_cast<double>(l.direction), lamp); };
    const auto nearest = std::ranges::max_element(d.lights, {}, closeness);
    const bool found = nearest != d.lights.end() && closeness(*nearest) > std::cos(kLampRadius_deg * kDeg);
    const std::uint32_t track = found ? nearest->track : 0;
    swaps += track != 0 && last != 0 && track != last ? 1 : 0;
    last = track;
    if (found && std::ranges::find(all, track) == all.end()) all.push_back(track);
  }
};

void set_time(measure::Shot& shot, std::int64_t number, double step_s) {
  for (Frame& frame : shot.frames) {
    frame.info.sequence =
        static_cast<std::uint64_t>(number) * shot.frames.size() + static_cast<std::uint64_t>(frame.info.bracket_index);
    frame.info.mid_exposure = {static_cast<std::int64_t>(static_cast<double>(number + 1) * step_s * 1e9)};
    frame.info.delivered = frame.info.mid_exposure + Duration{25'000'000};
  }
}

}  // namespace

int main(int argc, char** argv) {
  double wanted = 1e6;
  CLI::App app{"A day of a panorama estimator, with all settings in turn.", "measure_million"};
  app.add_option("--frames", wanted, "Frames [1000000]")->check(CLI::PositiveNumber);
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;

  const extremes::RigRenderer renderer(extremes::rig_of("pair", 160, 120, PixelFormat::rgb8));
  const measure::Camera camera(renderer.rig(), PixelFormat::rgb8);
  std::vector<measure::Shot> single = shots_of(renderer, camera, 1), brackets = shots_of(renderer, camera, 3);
  const std::vector<Phase> all = phases();
  const auto normals = ref::fibonacci_normals(kNormals);
  const auto round_frames = static_cast<std::int64_t>(all.size()) * kPhaseFrames;
  const auto rounds =
      std::max<std::int64_t>(kReferenceRound + 2, std::llround(std::ceil(wanted / static_cast<double>(round_frames))));
  const double step_s = kDay_s / static_cast<double>(rounds * round_frames);

  const std::unique_ptr<Estimator> estimator = extremes::estimator_of(renderer.rig());
  std::vector<IrradianceSamples> reference(all.size() * kCycleFrames);
  std::array<Tracks, std::size(kLampNames)> tracks;
  Descriptor d;
  std::int64_t number = 0;
  int refused = 0, unsound = 0, flagged = 0;
  double drift = 0, settled_kb = 0, largest_kb = 0;
  for (std::int64_t round = 0; round < rounds; ++round) {
    for (std::size_t p = 0; p < all.size(); ++p) {
      if (const Status s = estimator->configure(all[p].config); !s.ok()) fail(s.message());
      for (int i = 0; i < kPhaseFrames; ++i, ++number) {
        measure::Shot& shot = (all[p].exposures == 1 ? single : brackets)[static_cast<std::size_t>(i % kCycleFrames)];
        set_time(shot, number, step_s);
        if (!estimator->estimate(shot.frames, d).ok()) {
          ++refused;
          continue;
        }
        unsound += extremes::sound(d) ? 0 : 1;
        flagged += d.flags.any() ? 1 : 0;
        for (const Lamp lamp : {brightest, second, moving}) tracks[lamp].add(d, direction_of(lamp, i));
        if (i < kPhaseFrames - kCycleFrames || (round != kReferenceRound && round < rounds - 1)) continue;
        IrradianceSamples& then = reference[p * kCycleFrames + static_cast<std::size_t>(i % kCycleFrames)];
        const IrradianceSamples now = irradiance_of(d, normals);
        if (round == kReferenceRound) {
          then = now;
        } else if (const double change = difference(then, now); !(change <= drift)) {
          drift = change;
        }
      }
    }
    const double kb = resident_kb();
    if (round == kReferenceRound) settled_kb = kb;
    if (round >= kReferenceRound) largest_kb = std::max(largest_kb, kb);
    std::fprintf(stderr, "measure_million: round %lld of %lld, %.0f kB\n", static_cast<long long>(round + 1),
                 static_cast<long long>(rounds), kb);
  }
  print_figure("million.frames", static_cast<double>(number));
  print_figure("million.rounds", static_cast<double>(rounds));
  print_figure("million.refused", refused);
  print_figure("million.flagged", flagged);
  print_figure("million.unsound", unsound);
  print_figure("million.drift", drift);
  print_figure("million.growth_kb", largest_kb - settled_kb);
  for (const Lamp lamp : {brightest, second, moving}) {
    print_figure(std::string("million.tracks.") + kLampNames[lamp], static_cast<double>(tracks[lamp].all.size()));
    print_figure(std::string("million.swaps.") + kLampNames[lamp], tracks[lamp].swaps);
  }
  return 0;
}
