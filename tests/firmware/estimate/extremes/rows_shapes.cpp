// Images of unusual sizes, and lenses with a small field of view.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {

SightRow sizes() {
  SightRow row;
  constexpr int kSizes[][2] = {{1, 1},   {1, 2},    {2, 1},    {2, 2},     {3, 3},    {5, 7},  {8, 8},
                               {7, 16},  {16, 9},   {17, 23},  {33, 16},   {1, 64},   {64, 1}, {31, 31},
                               {61, 47}, {127, 65}, {129, 97}, {255, 129}, {160, 121}};
  for (const char* kind : {"pair", "single", "double_sphere", "equirect"})
    for (const PixelFormat format : {PixelFormat::rgb_f32, PixelFormat::rgb8})
      for (const auto& size : kSizes) {
        const RigRenderer renderer(rig_of(kind, size[0], size[1], format));
        Scene lit = constant({1, 0.9F, 0.8F});
        Chance chance(41);
        const Scene scenes[] = {lit, room(chance, 0), room(chance, format == PixelFormat::rgb8 ? 0 : 3)};
        for (const EstimatorConfig& config : every_choice()) {
          PanoramaOptions options;
          options.config = config;
          auto made = make_panorama_estimator(renderer.rig(), options);
          if (!made.ok()) {
            ++row.tally.refused;
            continue;
          }
          for (std::size_t i = 0; i < std::size(scenes); ++i) {
            const Pictures pictures = renderer.render(scenes[i]);
            const Shot shot = format == PixelFormat::rgb8 ? renderer.as_rgb8(pictures, i == 0 ? 5e-3 : 3e-4, i)
                                                          : renderer.as_floats(pictures);
            const std::string where = std::string(kind) + " " + std::to_string(size[0]) + "x" +
                                      std::to_string(size[1]) + " " + std::string(to_string(format)) + ", " +
                                      name_of(config) + ", scene " + std::to_string(i);
            Descriptor d;
            if (!(*made)->estimate(std::span(&shot.frame, 1), d).ok()) {
              ++row.tally.refused;
              continue;
            }
            row.tally.count(d, renderer.truth().normals(), renderer.truth().irradiance(pictures), where);
            if (d.coverage < 0.98F) row.tally.expect_flag(d, Flag::unseen, where);
            if (i != 0 || format == PixelFormat::rgb8 || std::isinf(d.bound.total)) continue;
            std::vector<reference::Rgb> constant_light(
                renderer.truth().normals().size(), {std::numbers::pi, 0.9 * std::numbers::pi, 0.8 * std::numbers::pi});
            const double error = error_of(d, renderer.truth().normals(), constant_light);
            if (error > row.worst) row.worst = error, row.worst_case = where;
          }
        }
      }
  return row;
}

namespace {

/// Partial coverage must be flagged, with an infinite bound, however the rest is filled.
void evaluate_partial(const Descriptor& d, double share, const std::string& where, SightRow& row) {
  if (!row.tally.count(d, where)) return;
  row.tally.expect_flag(d, Flag::unseen, where);
  row.tally.expect_no_bound(d, where);
  const double off = std::abs(d.coverage - share);
  if (off > row.worst) row.worst = off, row.worst_case = where;
}

std::string name_of(UnseenFill fill) {
  return fill == UnseenFill::none ? "nothing" : fill == UnseenFill::mirror ? "the mirror" : "the average";
}

}  // namespace

SightRow coverage() {
  SightRow row;
  for (const double share : {1e-6, 1e-4, 0.01, 0.25, 0.49}) {
    const RigRenderer renderer(rig_that_sees(share, 640, 640));
    const Pictures even = renderer.render(constant({1, 1, 1})), black = renderer.render(constant({0, 0, 0}));
    for (EstimatorConfig config : every_choice())
      for (const UnseenFill fill : {UnseenFill::none, UnseenFill::mirror, UnseenFill::average}) {
        config.panorama.unseen = fill;
        const auto estimator = estimator_of(renderer.rig(), config);
        for (const Pictures* p : {&even, &black, &even}) {
          Descriptor d;
          const Shot shot = renderer.as_floats(*p);
          if (!estimator->estimate(std::span(&shot.frame, 1), d).ok()) {
            ++row.tally.refused;
            continue;
          }
          evaluate_partial(
              d, share, std::to_string(100 * share) + " %, " + name_of(config) + ", filled with " + name_of(fill), row);
        }
      }
  }
  // No coverage: the image circle is outside of the image.
  RigParameters blind = rig_of("single", 64, 64);
  std::get<KannalaBrandtParameters>(blind.lenses[0].model).cx = 1e4;
  for (EstimatorConfig config : every_choice())
    for (const UnseenFill fill : {UnseenFill::none, UnseenFill::mirror, UnseenFill::average}) {
      config.panorama.unseen = fill;
      PanoramaOptions options;
      options.config = config;
      const auto made = make_panorama_estimator(blind, options);
      if (!made.ok()) {
        ++row.tally.refused;
        continue;
      }
      const RigRenderer renderer(blind);
      Pictures pictures = renderer.render(constant({1, 1, 1}));
      for (float& v : pictures[0]) v = 1;
      const Shot shot = renderer.as_floats(pictures);
      Descriptor d;
      if (!(*made)->estimate(std::span(&shot.frame, 1), d).ok())
        ++row.tally.refused;
      else
        evaluate_partial(d, 0, "nothing seen, " + name_of(config) + ", filled with " + name_of(fill), row);
    }
  return row;
}

SightRow camera_gone() {
  SightRow row;
  const RigRenderer pair(rig_of("pair", 320, 240));
  const Shot both = pair.as_floats(pair.render(constant({1, 1, 1})));
  for (EstimatorConfig config : every_choice())
    for (const UnseenFill fill : {UnseenFill::none, UnseenFill::mirror, UnseenFill::average}) {
      config.panorama.unseen = fill;
      const auto estimator = estimator_of(pair.rig(), config);
      for (const std::size_t left : {1U, 0U}) {
        Frame frame;
        frame.info = both.frame.info;
        if (left > 0) frame.add_view(both.frame.views()[0]);
        Descriptor d;
        // One cap of 95 degrees, or nothing; in the overlap, a lens counts for half.
        const double share = left > 0 ? 0.5 : 0;
        if (!estimator->estimate(std::span(&frame, 1), d).ok())
          ++row.tally.refused;
        else
          evaluate_partial(
              d, share, std::to_string(left) + " of two lenses, " + name_of(config) + ", filled with " + name_of(fill),
              row);
      }
    }
  return row;
}

}  // namespace lightwell::extremes
