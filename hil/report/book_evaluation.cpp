#include "report/book_evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "measure/panorama_sums.hpp"
#include "measure/specular_truth.hpp"
#include "reference/bright_region.hpp"
#include "reference/irradiance.hpp"

namespace lightwell::hil {
namespace {

namespace ref = reference;

/// Every so many held-out views is drawn; the picture shows the one whose elevation is nearest to this.
constexpr int kEveryView = 3;
constexpr double kShownElevation_deg = 40;
constexpr int kNormals = 2048;
constexpr int kShadowEdge = 128;

const std::vector<VirtualBall>& balls() {
  static const std::vector<VirtualBall> all = {{{-0.032, -0.01, 0.026}, 0.026, false},
                                               {{0.034, 0.012, 0.024}, 0.024, true}};
  return all;
}

ref::V3 world_of(Vec3d plane) { return ref::world_from_plane({plane.x, plane.y, plane.z}); }
Vec3f plane_of(const ref::V3& world) {
  const ref::V3 p = ref::plane_from_world(world);
  return vec_cast<float>(Vec3d{p.x, p.y, p.z});
}
ref::Rgb rgb(const auto& v) { return {static_cast<double>(v.r), static_cast<double>(v.g), static_cast<double>(v.b)}; }
template <class T>
T in_descriptor_units(const ref::Rgb& normalised) {
  return {static_cast<float>(normalised[0] / kFullScale), static_cast<float>(normalised[1] / kFullScale),
          static_cast<float>(normalised[2] / kFullScale)};
}

/// Twice the size of the view: pixels are averaged.
PlaneCamera camera_of(const measure::SpecularSequence& sequence, int view) {
  const ref::PinholeCamera p = sequence.pinhole();
  return {2 * p.width,
          2 * p.height,
          2 * p.focal_px,
          2 * p.focal_px,
          2 * p.cx + 0.5,
          2 * p.cy + 0.5,
          inverse(sequence.held_out_pose(view))};
}

LinearPicture picture_of(const ref::GlossyView& view) {
  LinearPicture out(view.width, view.height);
  for (std::size_t at = 0; at < out.pixels.size(); ++at) {
    out.pixels[at] = in_descriptor_units<Radiance>({view.rgb[3 * at], view.rgb[3 * at + 1], view.rgb[3 * at + 2]});
    out.alpha[at] = 1;
  }
  return out;
}

/// A layer drawn by the SDK; alpha is the part of a pixel that was drawn. `unseen`: adds the number of pixels whose
/// direction no frame saw.
LinearPicture drawn_by_sdk(const PlaneAppearance& plane, const PlaneCamera& camera, PlaneLayers layers,
                           double* unseen = nullptr) {
  const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  std::vector<float> values(3 * pixels, -1.0F);
  std::vector<std::uint8_t> flags(pixels, 0);
  (void)plane.render(camera, layers, values, flags);
  LinearPicture out(camera.width / 2, camera.height / 2);
  PlaneFlags no_direction;
  no_direction.set(PlaneFlag::unseen_direction);
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const std::size_t from =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(column);
      const float* const v = &values[3 * from];
      if (v[0] < 0) continue;  // Left alone.
      out.pixels[out.at(column / 2, row / 2)] += Radiance{v[0], v[1], v[2]} * 0.25F;
      out.alpha[out.at(column / 2, row / 2)] += 0.25F;
      if (unseen != nullptr && (flags[from] & no_direction.bits()) != 0) *unseen += 0.25;
    }
  for (std::size_t at = 0; at < out.pixels.size(); ++at)
    if (out.alpha[at] > 0) out.pixels[at] = out.pixels[at] * (1 / out.alpha[at]);
  return out;
}

/// Squared differences of intensities clipped at 1 over the pixels that are wholly on the plane.
struct Squares {
  double sum = 0, count = 0;
  [[nodiscard]] double rms() const { return std::sqrt(sum / std::max(count, 1.0)); }
  void operator+=(const Squares& o) { sum += o.sum, count += o.count; }
};
Squares compare(const ref::GlossyView& truth, const LinearPicture& drawn) {
  Squares out;
  for (std::size_t at = 0; at < drawn.pixels.size(); ++at) {
    if (truth.coverage[at] < 1) continue;
    const ref::Rgb ours = rgb(drawn.pixels[at]);
    for (std::size_t c = 0; c < 3; ++c) {
      const double d = std::min(1.0, kFullScale * ours[c]) - std::min(1.0, truth.rgb[3 * at + c]);
      out.sum += d * d, ++out.count;
    }
  }
  return out;
}

double elevation_deg(const measure::SpecularSequence& sequence, int view) {
  const Vec3d eye = inverse(sequence.held_out_pose(view)).translation;
  return std::asin(eye.z / length(eye)) * 180 / ref::pi;
}

/// The reference's shadows: the sum over the environment's pixels that no ball hides.
ShadowTexture true_shadows(const ref::Panorama& environment, double side_m) {
  struct Patch {
    Vec3d direction;
    ref::Rgb irradiance;
  };
  const ref::Panorama coarse = ref::turned(environment, {ref::V3{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 256, 128, 2);
  std::vector<Patch> patches;
  ref::Rgb all{};
  for (int j = 0; j < coarse.height / 2; ++j)
    for (int i = 0; i < coarse.width; ++i) {
      const ref::V3 d = ref::plane_from_world(ref::pixel_direction(i, j, coarse.width, coarse.height));
      const double weight = d.z * ref::pixel_solid_angle(j, coarse.width, coarse.height);
      ref::Rgb e = ref::pixel(coarse, i, j);
      for (std::size_t c = 0; c < 3; ++c) e[c] *= weight, all[c] += e[c];
      patches.push_back({{d.x, d.y, d.z}, e});
    }
  ShadowTexture out{side_m, kShadowEdge, {}};
  for (int row = 0; row < kShadowEdge; ++row)
    for (int column = 0; column < kShadowEdge; ++column) {
      const Vec3d p{((column + 0.5) / kShadowEdge - 0.5) * side_m, (0.5 - (row + 0.5) / kShadowEdge) * side_m, 0};
      ref::Rgb left = all;
      for (const Patch& patch : patches)
        for (const VirtualBall& ball : balls()) {
          const Vec3d m = ball.centre - p;
          const double b = dot(m, patch.direction);
          if (b <= 0 || b * b < dot(m, m) - ball.radius_m * ball.radius_m) continue;
          for (std::size_t c = 0; c < 3; ++c) left[c] -= patch.irradiance[c];
          break;
        }
      out.ratios.push_back({static_cast<float>(left[0] / all[0]), static_cast<float>(left[1] / all[1]),
                            static_cast<float>(left[2] / all[2])});
    }
  return out;
}

LinearPicture picture_of(const ShadowTexture& shadows) {
  LinearPicture out(shadows.edge, shadows.edge);
  for (std::size_t k = 0; k < out.pixels.size(); ++k)
    out.pixels[k] = {shadows.ratios[k].r, shadows.ratios[k].g, shadows.ratios[k].b}, out.alpha[k] = 1;
  return out;
}

double shadow_rms(const ShadowTexture& ours, const ShadowTexture& truth) {
  double sum = 0;
  for (std::size_t k = 0; k < truth.ratios.size(); ++k)
    for (int c = 0; c < 3; ++c) sum += std::pow(static_cast<double>(ours.ratios[k][c] - truth.ratios[k][c]), 2);
  return std::sqrt(sum / (3 * static_cast<double>(truth.ratios.size())));
}

/// The upper hemisphere of an equirectangular map of `radiance`, which gets directions in the plane's frame.
template <class RadianceOf>
LinearPicture upper_hemisphere(const RadianceOf& radiance) {
  LinearPicture out(BookPictures::kMapWidth, BookPictures::kMapWidth / 4);
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      out.pixels[out.at(i, j)] = radiance(plane_of(ref::pixel_direction(i, j, out.width, 2 * out.height)));
      out.alpha[out.at(i, j)] = 1;
    }
  return out;
}

double strongest_light_deg(const LinearPicture& truth, const Lighting& light) {
  ref::Panorama whole = ref::constant(truth.width, 2 * truth.height, {0, 0, 0});
  for (int j = 0; j < truth.height; ++j)
    for (int i = 0; i < truth.width; ++i) ref::set_pixel(whole, i, j, rgb(truth.pixels[truth.at(i, j)]));
  const std::optional<ref::BrightRegion> region = ref::bright_region(whole);
  double nearest = 180;
  for (const Light& l : light.lights())
    if (region) {
      const Vec3d d = vec_cast<double>(l.direction);
      nearest = std::min(nearest, ref::angle_deg(world_of(d), region->direction));
    }
  return nearest;
}

}  // namespace

Result<BookEvaluation> evaluate_book(const measure::SpecularSequence& sequence, const PlaneAppearance& plane,
                                     const Lighting& light) {
  BookEvaluation out;
  BookNumbers& numbers = out.numbers;
  numbers.seen = plane.guidance().seen;
  numbers.alpha = static_cast<double>(plane.info().gloss_alpha.value_or(0));

  int shown = 0;
  for (int k = 0; k < sequence.held_out_count(); k += kEveryView)
    if (std::abs(elevation_deg(sequence, k) - kShownElevation_deg) <
        std::abs(elevation_deg(sequence, shown) - kShownElevation_deg))
      shown = k;
  Squares all;
  for (int k = 0; k < sequence.held_out_count(); k += kEveryView) {
    const ref::GlossyView truth = sequence.held_out_view(k);
    LinearPicture drawn = drawn_by_sdk(plane, camera_of(sequence, k), PlaneLayers::all, &numbers.unseen);
    const Squares squares = compare(truth, drawn);
    all += squares;
    if (k != shown) continue;
    numbers.rmse_shown = squares.rms();
    out.pictures.real = picture_of(truth), out.pictures.drawn = std::move(drawn);
  }
  numbers.rmse = all.rms();
  numbers.unseen /= std::max(all.count / 3, 1.0);

  const measure::PanoramaSums truth(measure::surroundings(sequence, sequence.options().frames - 1));
  const std::vector<ref::V3> normals = ref::fibonacci_normals(kNormals);
  std::vector<ref::Rgb> true_irradiance, ours;
  for (const ref::V3& n : normals) {
    true_irradiance.push_back(truth.irradiance(n));
    ours.push_back(rgb(light.irradiance(plane_of(n)).value * static_cast<float>(kFullScale)));
  }
  numbers.irradiance_error = ref::irradiance_error(true_irradiance, ours).rms;
  numbers.irradiance_bound = static_cast<double>(light.descriptor().bound.total);

  const LightFunctions by_light{[&](Vec3d n) { return light.irradiance(vec_cast<float>(n)).value; },
                                [&](Vec3d d, float r) { return light.radiance(vec_cast<float>(d), r).value; }};
  const LightFunctions by_truth{
      [&](Vec3d n) { return in_descriptor_units<Irradiance>(truth.irradiance(world_of(n))); },
      [&](Vec3d d, float r) {
        return in_descriptor_units<Radiance>(truth.radiance(world_of(d), static_cast<double>(r)));
      }};
  const auto roughness = static_cast<float>(std::sqrt(sequence.options().alpha));
  out.pictures.light = upper_hemisphere([&](Vec3f d) { return by_light.radiance(vec_cast<double>(d), roughness); });
  out.pictures.true_light =
      upper_hemisphere([&](Vec3f d) { return by_truth.radiance(vec_cast<double>(d), roughness); });
  numbers.strongest_light_deg = strongest_light_deg(out.pictures.true_light, light);

  const Result<ShadowTexture> shadows = cast_shadows(light, balls(), measure::SpecularSequence::kPlane_m, kShadowEdge);
  if (!shadows) return shadows.status();
  const ShadowTexture shadows_of_truth = true_shadows(sequence.environment(), measure::SpecularSequence::kPlane_m);
  out.pictures.shadow = picture_of(*shadows), out.pictures.true_shadow = picture_of(shadows_of_truth);
  numbers.shadow_rms = shadow_rms(*shadows, shadows_of_truth);
  const PlaneCamera camera = camera_of(sequence, shown);
  const LinearPicture diffuse = drawn_by_sdk(plane, camera, PlaneLayers::diffuse);
  out.pictures.balls = draw_balls(camera, out.pictures.real, diffuse, balls(), by_light, *shadows);
  out.pictures.true_balls = draw_balls(camera, out.pictures.real, picture_of(sequence.held_out_diffuse(shown)), balls(),
                                       by_truth, shadows_of_truth);
  return out;
}

}  // namespace lightwell::hil
