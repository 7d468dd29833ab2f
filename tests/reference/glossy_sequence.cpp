#include "reference/glossy_sequence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace lightwell::reference {

namespace {

constexpr double kRadian = pi / 180;

// The streams of a seed.
enum Stream : std::uint64_t { kTrajectory = 1, kNoise = 2, kTexture = 3, kLamps = 4 };

/// A smooth signal in [-1, 1]: sines of random phase, at frequencies spread over a range.
class Sines {
 public:
  Sines(SplitMix& random, double lowest_hz, double highest_hz, int count = 4) {
    double total = 0;
    for (int k = 0; k < count; ++k) {
      const double hz = lowest_hz + (highest_hz - lowest_hz) * (k + random.uniform()) / count;
      terms_.push_back({random.uniform(0.5, 1), 2 * pi * hz, random.uniform(0, 2 * pi)});
      total += terms_.back().amplitude;
    }
    for (Term& term : terms_) term.amplitude /= total;
  }

  [[nodiscard]] double at(double time_s) const {
    double value = 0;
    for (const Term& t : terms_) value += t.amplitude * std::sin(t.rad_per_s * time_s + t.phase);
    return value;
  }

 private:
  struct Term {
    double amplitude = 0, rad_per_s = 0, phase = 0;
  };
  std::vector<Term> terms_;
};

M3 product(const M3& a, const M3& b) {
  const M3 columns = transposed(b);
  return transposed({rotated(a, columns[0]), rotated(a, columns[1]), rotated(a, columns[2])});
}

/// exp(w)
M3 rotation_of(const V3& w) { return rotation_about(w, length(w)); }

/// The rotation by the smallest angle that turns the direction `from` to `to`.
M3 smallest_rotation(const V3& from, const V3& to) {
  return rotation_about(cross(from, to), angle_deg(from, to) * kRadian);
}

/// A camera at the given direction from the plane's centre that looks at the centre, image up towards +Z.
M3 facing_centre(double elevation, double azimuth) {
  const double c = std::cos(azimuth), s = std::sin(azimuth), ce = std::cos(elevation), se = std::sin(elevation);
  return {V3{-s, c, 0}, V3{se * c, se * s, -ce}, V3{-ce * c, -ce * s, -se}};
}

Rgb mixed(const Rgb& a, const Rgb& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

constexpr double kInk = 0.03, kPaper = 0.8;

/// Draws on a texture in coordinates 0..1 from the upper left corner.
class Painter {
 public:
  Painter(int n, const Rgb& ground) : texture_(plain_texture(n, ground)) {}

  /// color(u, v) for the position in the rectangle, 0..1.
  template <typename Color>
  void fill(double left, double upper, double right, double lower, const Color& color) {
    const int i0 = texels(left), i1 = texels(right), j0 = texels(upper), j1 = texels(lower);
    for (int j = std::max(j0, 0); j < std::min(j1, texture_.n); ++j) {
      for (int i = std::max(i0, 0); i < std::min(i1, texture_.n); ++i) {
        const Rgb value = color((i + 0.5 - i0) / (i1 - i0), (j + 0.5 - j0) / (j1 - j0));
        const std::size_t at =
            3 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(texture_.n) + static_cast<std::size_t>(i));
        for (std::size_t c = 0; c < 3; ++c) texture_.rgb[at + c] = std::clamp(value[c], kInk, kPaper);
      }
    }
  }
  void fill(double left, double upper, double right, double lower, const Rgb& color) {
    fill(left, upper, right, lower, [&](double, double) { return color; });
  }
  [[nodiscard]] int texels(double position) const { return static_cast<int>(std::lround(position * texture_.n)); }
  [[nodiscard]] double share(int count) const { return static_cast<double>(count) / texture_.n; }
  [[nodiscard]] const PlaneTexture& texture() const { return texture_; }

 private:
  PlaneTexture texture_;
};

/// Lines of text: bars of one to nine letters' width with gaps, as thick as the space between them.
void write_lines(Painter& painter, SplitMix& random, double left, double upper, double right, double lower, int thick,
                 const Rgb& ink) {
  for (double y = upper; y + painter.share(thick) <= lower; y += painter.share(2 * thick)) {
    const double end = left + (right - left) * (random.uniform() < 0.2 ? random.uniform(0.3, 0.9) : 1);
    for (double x = left; x < end;) {
      const double word = painter.share(thick) * random.uniform(1.5, 7);
      painter.fill(x, y, std::min(x + word, end), y + painter.share(thick), ink);
      x += word + painter.share(thick);
    }
  }
}

Rgb ink_color(SplitMix& random, double from, double to) {
  Rgb color{};
  const double grey = random.uniform(from, to);
  for (double& c : color) c = std::clamp(grey * random.uniform(0.5, 1.5), kInk, kPaper);
  return color;
}

/// A smooth random picture: waves of random direction and colour, amplitudes falling with the frequency.
class Waves {
 public:
  explicit Waves(SplitMix& random) : mean_(ink_color(random, 0.25, 0.4)) {
    for (int k = 0; k < 24; ++k) {
      const double frequency = 0.7 * std::pow(1.18, k), angle = random.uniform(0, 2 * pi);
      Wave w{frequency * std::cos(angle), frequency * std::sin(angle), random.uniform(0, 1), {}};
      const double strength = 0.14 / std::pow(1 + frequency, 0.7);
      for (double& c : w.color) c = strength * (1 + 0.6 * random.gaussian());
      waves_.push_back(w);
    }
  }
  [[nodiscard]] Rgb at(double u, double v) const {
    Rgb value = mean_;
    for (const Wave& w : waves_) {
      const double s = std::sin(2 * pi * (w.u * u + w.v * v + w.phase));
      for (std::size_t c = 0; c < 3; ++c) value[c] += s * w.color[c];
    }
    return value;
  }

 private:
  struct Wave {
    double u = 0, v = 0, phase = 0;
    Rgb color{};
  };
  Rgb mean_;
  std::vector<Wave> waves_;
};

}  // namespace

SplitMix::SplitMix(std::uint64_t seed, std::uint64_t stream) : state_(seed) {
  state_ = next() ^ (stream * 0xD1B54A32D192ED03ULL);
  next();
}

std::uint64_t SplitMix::next() {
  state_ += 0x9E3779B97F4A7C15ULL;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

double SplitMix::uniform(double from, double to) {
  return from + (to - from) * ((static_cast<double>(next() >> 12) + 0.5) / 4503599627370496.0);
}

double SplitMix::gaussian() {
  const double r = std::sqrt(-2 * std::log(uniform()));
  return r * std::cos(2 * pi * uniform());
}

namespace {

/// Distance, gaze, roll and tremor of a hand, the same for every path of its viewing direction.
class Hand {
 public:
  Hand(SplitMix& random, const TrajectoryOptions& options)
      : options_(options),
        distance_(random, 0.05, 0.2),
        roll_(random, 0.02, 0.08),
        gaze_x_(random, 0.03, 0.1),
        gaze_y_(random, 0.03, 0.1) {
    for (int axis = 0; axis < 3; ++axis) tremor_.emplace_back(random, 3, 9, 5);
  }

  [[nodiscard]] Pose pose(double time, double elevation, double azimuth) const {
    const double range = 0.5 * (options_.nearest_m + options_.farthest_m) +
                         0.5 * (options_.farthest_m - options_.nearest_m) * distance_.at(time);
    const V3 eye = range * V3{std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                              std::sin(elevation)};
    // Within the square inside the circle.
    const V3 target = options_.gaze_radius_m * std::sqrt(0.5) * V3{gaze_x_.at(time), gaze_y_.at(time), 0};
    const M3 straight = facing_centre(elevation, azimuth);
    const M3 turned_to_target = smallest_rotation(rotated(straight, target - eye), {0, 0, 1});
    const M3 rolled = rotation_about({0, 0, 1}, options_.roll_deg * kRadian * roll_.at(time));
    const M3 shaken =
        rotation_of(options_.tremor_deg * kRadian * V3{tremor_[0].at(time), tremor_[1].at(time), tremor_[2].at(time)});
    Pose out;
    out.rotation = product(shaken, product(rolled, product(turned_to_target, straight)));
    out.translation = -1.0 * rotated(out.rotation, eye);
    return out;
  }

 private:
  TrajectoryOptions options_;
  Sines distance_, roll_, gaze_x_, gaze_y_;
  std::vector<Sines> tremor_;
};

}  // namespace

std::vector<Pose> hand_held_trajectory(std::uint64_t seed, int frames, const TrajectoryOptions& options) {
  SplitMix random(seed, kTrajectory);
  const double first_azimuth = random.uniform(0, 2 * pi), phase = random.uniform() < 0.5 ? 0 : pi;
  const double turns_a_swing = 0.5 * (1 + std::sqrt(5.0));
  const double swing_rad_per_s = options.azimuth_deg_per_s * kRadian / turns_a_swing;
  const double low = std::sin(options.lowest_deg * kRadian), high = std::sin(options.highest_deg * kRadian);
  const Sines wobble(random, 0.03, 0.08);
  const Hand hand(random, options);
  std::vector<Pose> poses;
  for (int frame = 0; frame < frames; ++frame) {
    const double time = frame / options.frames_per_s;
    const double azimuth = first_azimuth + options.azimuth_deg_per_s * kRadian * time + 10 * kRadian * wobble.at(time);
    const double elevation =
        std::asin(0.5 * (high + low) - 0.5 * (high - low) * std::cos(swing_rad_per_s * time + phase));
    poses.push_back(hand.pose(time, elevation, azimuth));
  }
  return poses;
}

std::vector<Pose> guided_trajectory(std::uint64_t seed, int frames, double turns, const TrajectoryOptions& options) {
  SplitMix random(seed, kTrajectory);
  const double first_azimuth = random.uniform(0, 2 * pi);
  const Hand hand(random, options);
  const double high = options.highest_deg * kRadian, low = options.lowest_deg * kRadian;
  const auto elevation_at = [&](double share) {
    return high + (low - high) * std::min(1.0, share * turns / (turns - 1));
  };
  // Length of the path of the viewing direction up to each of many azimuths.
  constexpr int kSteps = 4000;
  std::vector<double> length(kSteps + 1);
  for (int step = 1; step <= kSteps; ++step) {
    const double before = elevation_at((step - 1.0) / kSteps), after = elevation_at(static_cast<double>(step) / kSteps);
    length[static_cast<std::size_t>(step)] =
        length[static_cast<std::size_t>(step - 1)] +
        std::hypot(after - before, 2 * pi * turns / kSteps * std::cos(0.5 * (before + after)));
  }
  std::vector<Pose> poses;
  std::size_t next = 1;
  for (int frame = 0; frame < frames; ++frame) {
    const double reached = length.back() * (frame + 0.5) / frames;
    while (length[next] < reached) ++next;
    const double part = (reached - length[next - 1]) / (length[next] - length[next - 1]);
    const double share = (static_cast<double>(next - 1) + part) / kSteps;
    poses.push_back(
        hand.pose(frame / options.frames_per_s, elevation_at(share), first_azimuth + 2 * pi * turns * share));
  }
  return poses;
}

Pose pose_noise(std::uint64_t seed, int frame, double sigma_rad, double sigma_m) {
  SplitMix random(seed, (static_cast<std::uint64_t>(frame) << 8) | kNoise);
  std::array<double, 6> g{};
  for (double& value : g) value = random.gaussian();
  return {rotation_of(sigma_rad * V3{g[0], g[1], g[2]}), sigma_m * V3{g[3], g[4], g[5]}};
}

Pose perturbed(const Pose& T_camera_plane, const Pose& noise) {
  return {product(noise.rotation, T_camera_plane.rotation),
          rotated(noise.rotation, T_camera_plane.translation) + noise.translation};
}

PlaneTexture plain_texture(int n, const Rgb& albedo) {
  PlaneTexture texture{n, {}, false};
  for (int k = 0; k < n * n; ++k) texture.rgb.insert(texture.rgb.end(), albedo.begin(), albedo.end());
  return texture;
}

PlaneTexture book_texture(std::uint64_t seed, int n) {
  SplitMix random(seed, kTexture);
  Painter painter(n, {kPaper, kPaper, kPaper});
  const Rgb white{kPaper, kPaper, kPaper}, cover = ink_color(random, 0.08, 0.3), dark = ink_color(random, 0.03, 0.06);
  const double margin = random.uniform(0.02, 0.05), edge = random.uniform(0.06, 0.09);
  painter.fill(margin, margin, 1 - margin, 1 - margin, dark);  // the frame
  painter.fill(edge, edge, 1 - edge, 1 - edge, cover);
  // The title: a gradient with large letters.
  const double title = random.uniform(0.24, 0.32);
  const Rgb upper = ink_color(random, 0.05, 0.2), lower = ink_color(random, 0.3, 0.6);
  painter.fill(edge, edge, 1 - edge, title, [&](double, double v) { return mixed(upper, lower, v); });
  write_lines(painter, random, edge + 0.05, edge + 0.04, 1 - edge - 0.05, title - 0.02, 6, white);
  // The picture on one side, text on paper on the other.
  const double middle = random.uniform(0.45, 0.6), bottom = random.uniform(0.7, 0.76);
  const bool picture_left = random.uniform() < 0.5;
  const double picture_from = picture_left ? edge + 0.03 : 1 - middle,
               picture_to = picture_left ? middle : 1 - edge - 0.03;
  const double text_from = picture_left ? middle + 0.04 : edge + 0.03,
               text_to = picture_left ? 1 - edge - 0.03 : 0.96 - middle;
  const Waves waves(random);
  painter.fill(picture_from, title + 0.03, picture_to, bottom, [&](double u, double v) { return waves.at(u, v); });
  painter.fill(text_from, title + 0.03, text_to, bottom, white);
  write_lines(painter, random, text_from + 0.02, title + 0.05, text_to - 0.02, title + 0.2, 3, dark);
  write_lines(painter, random, text_from + 0.02, title + 0.23, text_to - 0.02, bottom - 0.02, 2, dark);
  // The foot: a row of colour patches, a band across two directions of gradient, a line of text.
  const int patches = 5;
  for (int k = 0; k < patches; ++k) {
    const double step = (1 - 2 * edge - 0.06) / patches, left = edge + 0.03 + k * step;
    painter.fill(left, bottom + 0.02, left + 0.9 * step, bottom + 0.08, ink_color(random, 0.1, 0.6));
  }
  const Rgb one = ink_color(random, 0.1, 0.5), two = ink_color(random, 0.2, 0.7);
  painter.fill(edge, bottom + 0.1, 1 - edge, 1 - edge,
               [&](double u, double v) { return mixed(one, two, 0.7 * u + 0.3 * v); });
  write_lines(painter, random, edge + 0.05, bottom + 0.12, 1 - edge - 0.05, 1 - edge - 0.01, 4,
              random.uniform() < 0.5 ? white : dark);
  return painter.texture();
}

Panorama lamps_on_gradient(int width, int height, const Rgb& zenith, const Rgb& nadir,
                           const std::vector<DiscLight>& lamps) {
  Panorama result = from_function(
      width, height, [&](const V3& d) { return mixed(nadir, zenith, 0.5 * (1 + d.y)); }, 1);
  for (const DiscLight& lamp : lamps) {
    result = sum(result, disc_lamp(width, height, lamp.towards, lamp.radius_rad, lamp.radiance));
  }
  return result;
}

Panorama random_lamps(std::uint64_t seed, int width, int height, int lamps) {
  SplitMix random(seed, kLamps);
  std::vector<DiscLight> lights;
  for (int attempt = 0; static_cast<int>(lights.size()) < lamps; ++attempt) {
    const double elevation = random.uniform(20, 80) * kRadian, azimuth = random.uniform(0, 2 * pi);
    DiscLight light;
    light.towards = {std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                     -std::cos(elevation) * std::cos(azimuth)};
    light.radius_rad = random.uniform(2, 6) * kRadian;
    const double bright = random.uniform(30, 100);
    light.radiance = {bright, bright * random.uniform(0.75, 1), bright * random.uniform(0.5, 1)};
    const bool crowded = std::any_of(lights.begin(), lights.end(), [&](const DiscLight& other) {
      return angle_deg(other.towards, light.towards) < 15;
    });
    if (!crowded || attempt > 1000) lights.push_back(light);
  }
  return lamps_on_gradient(width, height, {1.2, 1.1, 1}, {0.5, 0.5, 0.55}, lights);
}

}  // namespace lightwell::reference
