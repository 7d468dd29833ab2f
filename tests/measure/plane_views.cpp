#include "measure/plane_views.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Dense>

#include <lightwell/pixel.hpp>
#include <lightwell/quantile.hpp>

#include "estimate/specular/plane_motion.hpp"

namespace lightwell::measure {
namespace {

using Intensity = std::array<double, 3>;

/// Bilinear between texel centres, constant beyond the outermost ones. Unseen texels count as black.
Intensity texture_at(const PlaneAppearance& appearance, Vec3d p) {
  const int edge = appearance.texels.edge;
  const double x = std::clamp((p.x / appearance.texels.size_m + 0.5) * edge - 0.5, 0.0, edge - 1.0);
  const double y = std::clamp((0.5 - p.y / appearance.texels.size_m) * edge - 0.5, 0.0, edge - 1.0);
  const int i = std::min(static_cast<int>(x), edge - 2), j = std::min(static_cast<int>(y), edge - 2);
  Intensity out{};
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      const specular::TexelRadiance& t = appearance.texture[static_cast<std::size_t>((j + dy) * edge + i + dx)];
      if (!t.seen()) continue;
      const double w = (dx != 0 ? x - i : 1 - (x - i)) * (dy != 0 ? y - j : 1 - (y - j));
      out[0] += w * static_cast<double>(t.r), out[1] += w * static_cast<double>(t.g),
          out[2] += w * static_cast<double>(t.b);
    }
  return out;
}

constexpr int kSamples = 2;  ///< Along a side of a pixel.

/// One row of luminance, for gradients; NaN off the plane.
struct LuminancePair {
  std::vector<double> ours, truth;
};

double gradient_at(const std::vector<double>& image, int width, std::size_t at) {
  const auto w = static_cast<std::size_t>(width);
  return std::hypot(image[at + 1] - image[at - 1], image[at + w] - image[at - w]) / 2;
}

double luminance(const Intensity& v) { return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; }

}  // namespace

PlaneAppearance appearance_of(const specular::PlaneCapture& capture, const specular::GlossEstimate* gloss) {
  PlaneAppearance out;
  out.texels = capture.light_field().texels();
  capture.separation().sharpen(specular::kSharpenSteps, out.texture);
  out.alignment = capture.alignment();
  out.specular = capture.separation().specular();
  for (std::size_t node = 0; gloss != nullptr && node < out.specular.value.size(); ++node)
    if (!(out.specular.weight[node] > 0))
      out.specular.value[node] =
          gloss->predicted(vec_cast<float>(out.specular.grid.direction(node))).value_or(out.specular.value[node]);
  return out;
}

PlaneAppearance published_appearance(const specular::PlaneCapture& capture) {
  const specular::SurfaceLightField& field = capture.light_field();
  PlaneAppearance out;
  out.texels = field.texels();
  out.alignment = capture.alignment();
  out.interpolate = false;
  const auto medians = capture.separation().medians();
  for (const specular::RunningMedian& m : medians)
    out.texture.push_back({m.value()[0], m.value()[1], m.value()[2], m.empty() ? specular::TexelRadiance::kUnseen : 0});
  out.specular = specular::Lumisphere(field.grid().levels());
  std::vector<Intensity> sum(field.grid().size());
  std::vector<double> count(field.grid().size());
  const int tiles = out.texels.tiles() * out.texels.tiles();
  for (int tile = 0; tile < tiles; ++tile)
    field.for_each_page(tile, [&](const specular::LightFieldPage& page) {
      for (int k = 0; k < specular::kTileTexels; ++k) {
        if ((page.filled >> k & 1) == 0) continue;
        const auto v = rgb9e5_decode(page.sample[static_cast<std::size_t>(k)]);
        const auto& median = medians[out.texels.texel_of(tile, k)].value();
        for (std::size_t c = 0; c < 3; ++c) sum[page.node][c] += static_cast<double>(v[c] - median[c]);
        ++count[page.node];
      }
    });
  for (std::size_t node = 0; node < count.size(); ++node) {
    if (!(count[node] > 0)) continue;
    const double scale = 1 / count[node];
    out.specular.value[node] = {static_cast<float>(sum[node][0] * scale), static_cast<float>(sum[node][1] * scale),
                                static_cast<float>(sum[node][2] * scale)};
    out.specular.weight[node] = static_cast<float>(count[node]);
  }
  return out;
}

std::vector<HeldOutView> held_out_views(const SpecularSequence& sequence) {
  std::vector<HeldOutView> out;
  for (int k = 0; k < sequence.held_out_count(); ++k)
    out.push_back({sequence.held_out_pose(k), sequence.held_out_view(k)});
  return out;
}

ViewErrors view_errors(const SpecularSequence& sequence, const std::vector<HeldOutView>& views,
                       const PlaneAppearance& appearance) {
  const reference::PinholeCamera camera = sequence.pinhole();
  const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  constexpr double kOff = std::numeric_limits<double>::quiet_NaN();
  ViewErrors out;
  double squares = 0, seen_squares = 0, count = 0;
  for (const HeldOutView& view : views) {
    const Pose plane_lens = inverse(compose(inverse(sequence.rig().lenses[0].pose_cv), view.probe_plane));
    const Vec3d eye = plane_lens.translation;
    LuminancePair lines{std::vector<double>(pixels, kOff), std::vector<double>(pixels, kOff)};
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      if (view.truth.coverage[pixel] < 1) continue;
      const auto x = static_cast<double>(pixel % static_cast<std::size_t>(camera.width));
      const auto y = static_cast<double>(pixel / static_cast<std::size_t>(camera.width));
      const auto point = [&](double column, double row) {
        const Vec3d ray = rotate(plane_lens.rotation,
                                 Vec3d{(column - camera.cx) / camera.focal_px, (row - camera.cy) / camera.focal_px, 1});
        return eye - ray * (eye.z / ray.z);
      };
      Intensity ours{};
      for (int sy = 0; sy < kSamples; ++sy)
        for (int sx = 0; sx < kSamples; ++sx) {
          const Vec3d p = point(x + (sx + 0.5) / kSamples - 0.5, y + (sy + 0.5) / kSamples - 0.5);
          const Intensity d = texture_at(appearance, appearance.alignment.texture_point(p));
          for (std::size_t c = 0; c < 3; ++c) ours[c] += d[c] / (kSamples * kSamples);
        }
      auto where = appearance.specular.grid.interpolate(vec_cast<float>(eye - point(x, y)));
      if (!appearance.interpolate) {
        const auto best = std::max_element(where.weight.begin(), where.weight.end()) - where.weight.begin();
        where.node.fill(where.node[static_cast<std::size_t>(best)]);
      }
      const Radiance s = appearance.specular.at(where);
      ours[0] += static_cast<double>(s.r), ours[1] += static_cast<double>(s.g), ours[2] += static_cast<double>(s.b);
      bool saturated = false, seen = true;
      for (const std::uint32_t node : where.node) seen = seen && appearance.specular.weight[node] > 0;
      Intensity truth{};
      double square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        truth[c] = view.truth.rgb[3 * pixel + c];
        saturated = saturated || truth[c] > 1;
        truth[c] = std::min(truth[c], 1.0), ours[c] = std::min(ours[c], 1.0);
        square += (ours[c] - truth[c]) * (ours[c] - truth[c]);
      }
      squares += square;
      seen_squares += seen ? square : 0;
      lines.ours[pixel] = luminance(ours), lines.truth[pixel] = luminance(truth);
      out.saturated += saturated ? 1 : 0;
      out.unseen += seen ? 0 : 1;
      ++count;
    }
    for (int y = 1; y + 1 < camera.height; ++y)
      for (int x = 1; x + 1 < camera.width; ++x) {
        const auto at = static_cast<std::size_t>(y * camera.width + x);
        const double difference =
            std::abs(gradient_at(lines.ours, camera.width, at) - gradient_at(lines.truth, camera.width, at));
        // NaN, off the plane, compares false.
        if (difference > out.max_gradient_difference) out.max_gradient_difference = difference;
      }
  }
  const double n = std::max(count, 1.0);
  out.rmse = std::sqrt(squares / (3 * n));
  out.rmse_seen = std::sqrt(seen_squares / (3 * std::max(count - out.unseen, 1.0)));
  out.saturated /= n, out.unseen /= n;
  return out;
}

RefinementTruth refinement_truth(const SpecularSequence& sequence, const std::vector<RefinedFrame>& frames) {
  constexpr double kCorner_m = 0.08;
  const auto lens_of = [&](const Pose& plane) {
    return inverse(compose(inverse(sequence.rig().lenses[0].pose_cv), plane)).translation;
  };
  const auto height_of = [](Vec3d lens) { return lens.z / length(lens); };
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const RefinedFrame& f : frames) {
    const Pose truth = sequence.true_pose(f.frame), plane_texture = compose(inverse(truth), f.pose.probe_plane);
    const Vec3d eye = lens_of(truth);
    if (height_of(eye) < std::sin(20 * reference::pi / 180)) continue;
    for (const double x : {-kCorner_m, kCorner_m})
      for (const double y : {-kCorner_m, kCorner_m}) {
        const Vec3d point = transformed(plane_texture, {x, y, 0}), ray = point - eye;
        const Vec3d seen = eye - ray * (eye.z / ray.z);
        Eigen::Matrix<double, 2, 4> design;
        design << 1, 0, -y, x, 0, 1, x, y;
        normal += design.transpose() * design;
        right += design.transpose() * Eigen::Vector2d(seen.x - x, seen.y - y);
      }
  }
  RefinementTruth out;
  const Eigen::Vector4d x = normal.ldlt().solve(right);
  out.alignment = {x[0], x[1], x[2], x[3]};
  std::vector<double> distances;
  for (const RefinedFrame& f : frames) {
    const Pose truth = sequence.true_pose(f.frame);
    const Vec3d eye = lens_of(truth);
    if (height_of(eye) > std::sin(40 * reference::pi / 180)) continue;
    const specular::Vector6 error =
        specular::logarithm(compose(inverse(out.alignment.texture_pose(truth, eye)), f.pose.probe_plane));
    double sum = 0;
    for (std::size_t r = 0; r < 6; ++r)
      for (std::size_t c = 0; c < 6; ++c)
        sum += error[static_cast<Eigen::Index>(r)] * f.pose.information[r][c] * error[static_cast<Eigen::Index>(c)];
    distances.push_back(sum / 6);
  }
  if (!distances.empty()) out.variance_factor = median(distances);
  return out;
}

double distance_mm(const specular::TextureAlignment& a, const specular::TextureAlignment& b) {
  return 1e3 * std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

}  // namespace lightwell::measure
