// Simulates the row profiles of a pair of fisheye lenses with a rolling shutter in a room with a rotating probe, a
// walking person, switched lamps and mains flicker. Coarse in space, exact in time.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "estimate/frames/flicker.hpp"
#include "imaging/frame.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"

namespace lightwell::estimate {

struct RoomOptions {
  double frame_rate = 30;
  double readout_s = 30e-6;
  std::vector<double> exposure_s = {0.002};
  sim::MainsFlicker flicker;
  double noise = 1e-3;          ///< Relative standard deviation of a group of rows in one frame.
  double yaw_rad_per_s = 0;     ///< Rotation about +Y.
  double tilt_rad = 0;          ///< Amplitude of an oscillation about +X, across the rows.
  double tilt_hz = 0;           ///< Its frequency.
  double person_rad_per_s = 0;  ///< A person at a distance of 1 m, walking around the probe; 0: none.
  double lamp_period_s = 0;     ///< Period of a lamp that is switched on and off; 0: on.
  double jitter_s = 0;          ///< Of frame times, uniform.
  double mismatch = 0;          ///< Relative error of the second exposure, in a pattern along the rows.
  std::uint64_t seed = 1;
};

class MovingRoom {
 public:
  static constexpr int kRows = 480, kGroupRows = 8, kGroups = kRows / kGroupRows, kColumns = 20;

  explicit MovingRoom(RoomOptions options)
      : options_(std::move(options)), random_(options_.seed), world_(room(options_.seed)) {
    for (auto& lens : light_) lens.assign(kGroups, 0);
  }

  /// Advances to the next frame.
  void step() {
    const auto n = options_.exposure_s.size();
    const double exposure = options_.exposure_s[frame_ % n];
    std::uniform_real_distribution<double> even(-0.5, 0.5);
    const double t = 10 + static_cast<double>(frame_) / options_.frame_rate + options_.jitter_s * even(random_);
    info.sequence = frame_;
    info.mid_exposure.ns = std::llround(t * 1e9);
    info.exposure_s = exposure;
    info.row_readout = Duration::from_seconds(options_.readout_s);
    info.bracket_index = static_cast<int>(frame_ % n);
    info.bracket_size = static_cast<int>(n);
    std::normal_distribution<double> normal;
    for (int lens = 0; lens < kMaxLenses; ++lens) {
      for (int g = 0; g < kGroups; ++g) {
        const double middle = (g + 0.5) * kGroupRows - kRows / 2.0;
        double modulation = 0;
        for (int j = 0; j < kGroupRows; ++j) {
          const double row = g * kGroupRows + j - (kRows - 1) / 2.0;
          modulation += options_.flicker.factor(t + row * options_.readout_s, exposure) / kGroupRows;
        }
        double l = row_radiance(lens, g, t + middle * options_.readout_s) * modulation *
                   (1 + options_.noise * normal(random_));
        if (info.bracket_index == 1) l *= 1 + options_.mismatch * std::sin(0.11 * g);
        light_[static_cast<std::size_t>(lens)][static_cast<std::size_t>(g)] = static_cast<float>(l);
      }
    }
    ++frame_;
  }

  [[nodiscard]] std::array<RowProfile, kMaxLenses> profiles() const {
    return {{{light_[0], kRows, kGroupRows}, {light_[1], kRows, kGroupRows}}};
  }

  FrameInfo info;

 private:
  /// Walls, a window, lamps, and a pattern of all spatial frequencies.
  static sim::Panorama room(std::uint64_t seed) {
    std::mt19937_64 random(seed + 1000);
    std::normal_distribution<double> normal;
    struct Wave {
      Vec3d k;
      double phase, size;
    };
    std::vector<Wave> waves;
    for (int i = 0; i < 24; ++i) {
      const double scale = 1 + i * 0.7;
      waves.push_back(
          {Vec3d{normal(random), normal(random), normal(random)} * scale, 6.28 * normal(random), 0.5 / scale + 0.03});
    }
    return sim::from_function(256, [&](Vec3d d) {
      double l = 0;
      for (const Wave& w : waves) l += w.size * std::sin(dot(w.k, d) + w.phase);
      double v = std::exp(l) * (d.y > 0.5 ? 2 : d.y < -0.6 ? 0.3 : 1);
      if (d.x > 0.7 && std::abs(d.y) < 0.4) v *= 4;
      if (dot(d, normalized(Vec3d{-0.5, 0.8, -0.3})) > 0.995) v *= 60;
      const auto f = static_cast<float>(v);
      return Radiance{f, f, f};
    });
  }

  [[nodiscard]] double row_radiance(int lens, int group, double t) const {
    using std::numbers::pi;
    const Quat pose = Quat::about({0, 1, 0}, options_.yaw_rad_per_s * t) *
                      Quat::about({1, 0, 0}, options_.tilt_rad * std::sin(2 * pi * options_.tilt_hz * t));
    const double y = 1 - (group + 0.5) * 2 / kGroups;
    const double person = options_.person_rad_per_s * t;
    const bool lamp_off =
        options_.lamp_period_s > 0 && std::fmod(t, options_.lamp_period_s) > options_.lamp_period_s / 2;
    double sum = 0;
    int n = 0;
    for (int i = 0; i < kColumns; ++i) {
      const double x = (i + 0.5) * 2 / kColumns - 1;
      const double r = std::hypot(x, y);
      if (r > 1) continue;
      const double theta = r * 95 * pi / 180, s = r > 0 ? std::sin(theta) / r : 0;
      Vec3d d{x * s, y * s, -std::cos(theta)};
      if (lens == 1) d = {-d.x, d.y, -d.z};
      d = rotate(pose, d);
      double l = world_.radiance(d).luminance();
      // The lamp illuminates the room, its own side more.
      if (lamp_off) l *= 0.6 + 0.2 * d.x;
      if (options_.person_rad_per_s != 0) {
        // 0.5 m wide, 1.8 m tall, with a vertical motion of two steps per second and swinging arms.
        const double a = std::remainder(std::atan2(d.x, -d.z) - person, 2 * pi);
        const double h = d.y / std::hypot(d.x, d.z) - 0.03 * std::sin(4 * pi * t);
        const double width = h > 0.4 ? 0.12 : 0.25 + 0.1 * std::sin(2 * pi * t) * (h < 0.2);
        if (std::abs(a) < width && h < 0.7 && h > -1.1) l = h > 0.4 ? 0.5 : 0.1;
      }
      sum += l;
      ++n;
    }
    return n > 0 ? sum / n : std::numeric_limits<double>::quiet_NaN();
  }

  RoomOptions options_;
  std::mt19937_64 random_;
  sim::Panorama world_;
  std::uint64_t frame_ = 0;
  std::array<std::vector<float>, kMaxLenses> light_;
};

/// Number of frames by detector state.
struct StateCounts {
  int unknown = 0, none = 0, hz100 = 0, hz120 = 0;
  Flicker last = Flicker::unknown;
};

[[nodiscard]] inline StateCounts count_states(const RoomOptions& options, int frames, FlickerDetector& detector) {
  MovingRoom room(options);
  StateCounts out;
  for (int i = 0; i < frames; ++i) {
    room.step();
    out.last = detector.add(room.info, room.profiles());
    switch (out.last) {
      case Flicker::unknown:
        ++out.unknown;
        break;
      case Flicker::none:
        ++out.none;
        break;
      case Flicker::hz100:
        ++out.hz100;
        break;
      case Flicker::hz120:
        ++out.hz120;
        break;
    }
  }
  return out;
}

}  // namespace lightwell::estimate
