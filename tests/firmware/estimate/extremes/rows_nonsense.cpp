// Invalid and extreme input: darkness, saturation, NaN, infinite, negative and huge values, impossible exposures.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

bool answer(Estimator& estimator, const Shot& shot, Descriptor& d, Tally& tally) {
  const bool answered = estimator.estimate(std::span(&shot.frame, 1), d).ok();
  if (!answered) ++tally.refused;
  return answered;
}

Pictures filled(const RigRenderer& renderer, float value) { return renderer.render(constant({value, value, value})); }

void fill_codes(Shot& shot, int code) {
  for (std::vector<std::byte>& picture : shot.bytes) std::ranges::fill(picture, static_cast<std::byte>(code));
}

/// Replaces NaN and negative values by 0, as the estimator does.
Pictures without_invalid(Pictures pictures) {
  for (std::vector<float>& picture : pictures)
    for (float& v : picture)
      if (!(v > 0)) v = 0;
  return pictures;
}

}  // namespace

Tally all_black(PixelFormat format) {
  Tally tally;
  const auto expect_dark = [&](Estimator& estimator, const Shot& shot, const std::string& where) {
    Descriptor d;
    if (!answer(estimator, shot, d, tally)) return;
    tally.count(d, where);
    tally.expect_flag(d, Flag::dark, where);
    tally.expect_no_bound(d, where);
    if (!d.lights.empty() && tally.silent++ == 0) tally.silent_case = where + ": a light";
  };
  for (const char* kind : {"pair", "single", "double_sphere", "equirect"}) {
    const RigRenderer renderer(rig_of(kind, 160, std::string(kind) == "equirect" ? 80 : 120, format));
    for (const EstimatorConfig& config : every_choice()) {
      const auto estimator = estimator_of(renderer.rig(), config);
      const std::string where = std::string(kind) + " " + name_of(config);
      if (format == PixelFormat::rgb_f32) {
        for (const float value : {0.0F, -0.0F})
          expect_dark(*estimator, renderer.as_floats(filled(renderer, value)), where);
      } else {
        Shot shot = renderer.as_rgb8(filled(renderer, 0), 0.01, 0);
        fill_codes(shot, 0);
        expect_dark(*estimator, shot, where);
      }
    }
  }
  return tally;
}

Tally all_saturated() {
  Tally tally;
  for (const char* kind : {"pair", "single", "double_sphere", "equirect"}) {
    const RigRenderer codes(rig_of(kind, 160, std::string(kind) == "equirect" ? 80 : 120, PixelFormat::rgb8));
    for (const EstimatorConfig& config : every_choice()) {
      const auto estimator = estimator_of(codes.rig(), config);
      Shot shot = codes.as_rgb8(filled(codes, 0), 0.01, 0);
      // 98 % of the scale is 249.9.
      for (const int code : {250, 255}) {
        fill_codes(shot, code);
        const std::string where = std::string(kind) + " " + name_of(config) + ", code " + std::to_string(code);
        Descriptor d;
        if (!answer(*estimator, shot, d, tally)) continue;
        tally.count(d, where);
        tally.expect_flag(d, Flag::clipped, where);
        tally.expect_no_bound(d, where);
        // Lower bound: full scale is a radiance of 1 on the axis here, and saturation starts 2 % below in sRGB.
        if (!(d.saturated > 0.99F && (std::string(kind) == "single" || d.radiance.c[0].g > 0.95 * 3.5449)) &&
            tally.silent++ == 0)
          tally.silent_case =
              where + ": saturated " + std::to_string(d.saturated) + ", c0 " + std::to_string(d.radiance.c[0].g);
      }
    }
  }
  return tally;
}

const char* name_of(Extent extent) {
  switch (extent) {
    case Extent::one_pixel:
      return "one_pixel";
    case Extent::one_row:
      return "one_row";
    case Extent::everywhere:
      return "everywhere";
  }
  return "unknown";
}

Tally nonsense(Extent extent) {
  Tally tally;
  for (const char* kind : {"pair", "equirect"}) {
    const bool sphere = std::string(kind) == "equirect";
    const RigRenderer renderer(rig_of(kind, 160, sphere ? 80 : 120));
    Scene scene = constant({1, 0.9F, 0.8F});
    scene.discs.push_back({normalized(Vec3d{0.3, 0.8, -0.5}), 0.08, {300, 250, 200}});
    const Pictures good = renderer.render(scene);
    const LensTable& lens = renderer.table().lenses[0];
    const auto width = static_cast<std::size_t>(lens.width), height = static_cast<std::size_t>(lens.height);
    for (const EstimatorConfig& config : every_choice()) {
      const auto estimator = estimator_of(renderer.rig(), config);
      for (const float value : {kNan, -kNan, kInf, -kInf, -1.0F, -1e30F, -1e-20F})
        for (std::size_t channels = 1; channels <= 3; channels += 2)
          for (const std::size_t row : {height / 2, height / 2 - 31, std::size_t{6}}) {
            Pictures bad = good;
            const std::size_t first =
                extent == Extent::everywhere ? 0 : row * width + (extent == Extent::one_pixel ? width / 2 + 3 : 0);
            const std::size_t count = extent == Extent::one_pixel ? 1
                                      : extent == Extent::one_row ? width
                                                                  : width * height;
            for (std::size_t k = 0; k < (extent == Extent::everywhere ? bad.size() : 1); ++k)
              for (std::size_t i = first; i < first + count; ++i)
                for (std::size_t c = 0; c < channels; ++c) bad[k][3 * i + (c + 1) % 3] = value;
            const std::string where = std::string(kind) + ", " + name_of(config) + ", " + std::to_string(value) +
                                      " in " + std::to_string(channels) + " channels, row " + std::to_string(row);
            Descriptor d;
            if (!answer(*estimator, renderer.as_floats(bad), d, tally)) continue;
            tally.expect_flag(d, Flag::cleaned, where);
            if (value == kInf) {
              tally.count(d, where);
              tally.expect_no_bound(d, where);
            } else {
              tally.count(d, renderer.truth().normals(), renderer.truth().irradiance(without_invalid(bad)), where);
            }
          }
      // The next frame must be unaffected.
      Descriptor d;
      if (!answer(*estimator, renderer.as_floats(good), d, tally)) continue;
      tally.count(d, renderer.truth().normals(), renderer.truth().irradiance(good),
                  std::string(kind) + ", the frame after");
      if (d.flags.any() && tally.silent++ == 0) tally.silent_case = std::string(kind) + ", the frame after is flagged";
    }
  }
  return tally;
}

Tally huge() {
  Tally tally;
  const RigRenderer renderer(rig_of("pair", 160, 120));
  for (const EstimatorConfig& config : every_choice())
    for (const float value : {1e-44F, 1e-38F, 1e-30F, 1e30F, 1e36F, 1e38F, std::numeric_limits<float>::max()}) {
      const Pictures even = filled(renderer, value);
      Pictures spot = filled(renderer, 1), low = even;
      spot[0][3 * (60 * 160 + 83)] = value;
      for (std::size_t i = 0; i < low[0].size() / 2; ++i) low[0][i] = 0;
      const Pictures* pictures[] = {&even, &spot, &low};
      const char* names[] = {" everywhere", " in one pixel", " in a half"};
      for (std::size_t i = 0; i < 3; ++i) {
        const std::string where = name_of(config) + ", " + std::to_string(std::log10(value)) + " decades" + names[i];
        Descriptor d;
        if (!answer(*estimator_of(renderer.rig(), config), renderer.as_floats(*pictures[i]), d, tally)) continue;
        // The oracle's sums are floats, too, and overflow above this.
        if (value < 1e35F)
          tally.count(d, renderer.truth().normals(), renderer.truth().irradiance(*pictures[i]), where);
        else
          tally.count(d, where);
      }
    }
  return tally;
}

Tally bright_pixel_on_the_wire() {
  Tally tally;
  const RigRenderer renderer(rig_of("pair", 160, 120));
  const Pictures even = filled(renderer, 1);
  for (const EstimatorConfig& config : every_choice()) {
    const auto estimator = estimator_of(renderer.rig(), config);
    for (int decade = 9; decade <= 30; ++decade)
      for (std::size_t channels = 1; channels <= 3; channels += 2) {
        Pictures pictures = even;
        const auto level = static_cast<float>(std::pow(10.0, decade));
        for (std::size_t c = 0; c < channels; ++c) pictures[0][3 * (60 * 160 + 83) + c] = level;
        Descriptor d;
        if (!answer(*estimator, renderer.as_floats(pictures), d, tally)) continue;
        tally.count(
            d, renderer.truth().normals(), renderer.truth().irradiance(pictures),
            name_of(config) + ", 1e" + std::to_string(decade) + " in " + std::to_string(channels) + " channels");
      }
  }
  return tally;
}

Tally random_bits(int frames) {
  Tally tally;
  const RigRenderer renderer(rig_of("pair", 64, 48));
  for (const EstimatorConfig& config : every_choice()) {
    const auto estimator = estimator_of(renderer.rig(), config);
    Chance chance(31);
    for (int i = 0; i < frames; ++i) {
      Pictures pictures = filled(renderer, 1);
      const std::uint32_t often = 1U << chance.below(12);
      bool nonsense = false;
      for (std::size_t k = 0; k < pictures.size(); ++k)
        for (std::size_t j = 0; j < pictures[k].size(); ++j) {
          const std::uint32_t bits = chance.bits();
          float& v = pictures[k][j];
          if (bits % often == 0)
            std::memcpy(&v, &bits, sizeof v);
          else
            v = std::pow(10.0F, static_cast<float>(bits % 1200) / 100 - 6);
          nonsense |= renderer.table().lenses[k].solid_angle[j / 3] > 0 && !(v >= 0 && v < kInf);
        }
      Descriptor d;
      const std::string where = name_of(config) + ", frame " + std::to_string(i);
      if (!answer(*estimator, renderer.as_floats(pictures), d, tally)) continue;
      tally.count(d, where);
      if (nonsense) tally.expect_flag(d, Flag::cleaned, where);
    }
  }
  return tally;
}

SightRow exposures() {
  SightRow row;
  constexpr double kHuge = std::numeric_limits<double>::infinity(), kNone = std::numeric_limits<double>::quiet_NaN();
  const RigRenderer floats(rig_of("pair", 160, 120)), codes(rig_of("pair", 160, 120, PixelFormat::rgb8));
  Scene scene = constant({1, 0.9F, 0.8F});
  scene.discs.push_back({normalized(Vec3d{0.3, 0.8, -0.5}), 0.12, {20, 20, 20}});
  for (const bool float_pixels : {true, false}) {
    const RigRenderer& renderer = float_pixels ? floats : codes;
    const Pictures pictures = renderer.render(scene);
    const Shot shot = float_pixels ? renderer.as_floats(pictures) : renderer.as_rgb8(pictures, 4e-4, 1);
    const double right = shot.frame.info.exposure_s;
    for (const EstimatorConfig& config : every_choice()) {
      const auto estimator = estimator_of(renderer.rig(), config);
      Descriptor one;
      if (!answer(*estimator, shot, one, row.tally)) continue;
      for (const double factor :
           {0.0, -0.0, -1.0, kHuge, -kHuge, kNone, 1e-300, 1e-30, 1e-20, 1e-10, 1e10, 1e20, 1e30, 1e300})
        for (const bool gain : {false, true}) {
          Frame frame;
          frame.info = shot.frame.info;
          for (const View& v : shot.frame.views()) frame.add_view(v);
          if (gain)
            frame.info.gain = factor;
          else
            frame.info.exposure_s = factor * right;
          const std::string where = std::string(float_pixels ? "floats, " : "codes, ") + name_of(config) +
                                    (gain ? ", gain times " : ", exposure times ") + std::to_string(factor);
          Descriptor d;
          const Status s = estimator->estimate(std::span(&frame, 1), d);
          if (!s.ok()) {
            ++row.tally.refused;
            continue;
          }
          if (!(factor > 0 && factor < kHuge) && row.tally.silent++ == 0) row.tally.silent_case = where + ": answered";
          if (!row.tally.count(d, where) || d.flags.any() || gain) continue;
          const double got = static_cast<double>(d.radiance.c[0].g) * factor,
                       deviation = std::abs(got / one.radiance.c[0].g - 1);
          if (deviation > row.worst || !std::isfinite(deviation)) row.worst = deviation, row.worst_case = where;
        }
      // The next frame must be unaffected.
      Descriptor again;
      if (!answer(*estimator, shot, again, row.tally)) continue;
      row.tally.count(again, renderer.truth().normals(), renderer.truth().irradiance(pictures), "the frame after");
    }
  }
  return row;
}

}  // namespace lightwell::extremes
