#include "report/picture.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include <lightwell/cap.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "imaging/image_file.hpp"
#include "report/samples.hpp"
#include "report/shading.hpp"
#include "sim/render.hpp"

namespace lightwell::hil {
namespace {

constexpr int kMargin = 16, kBallEdge = 170, kStillWidth = 300, kText = 22;
constexpr float kGlossy = 0.5F;
const cv::Scalar kPaper(245, 245, 245), kInk(40, 40, 40), kMark(60, 60, 255);

cv::Vec3b tone(const Radiance& l, double exposure) {
  const auto code = [&](double v) {
    return static_cast<unsigned char>(std::lround(255 * linear_to_srgb(std::clamp(v * exposure, 0.0, 1.0))));
  };
  return {code(l.b), code(l.g), code(l.r)};
}

void paste(cv::Mat& page, const LinearPicture& p, int x, int y, double exposure) {
  for (int j = 0; j < p.height; ++j) {
    for (int i = 0; i < p.width; ++i) {
      const std::size_t at =
          static_cast<std::size_t>(j) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(i);
      const cv::Vec3b over = tone(p.pixels[at], exposure);
      cv::Vec3b& under = page.at<cv::Vec3b>(y + j, x + i);
      for (int k = 0; k < 3; ++k)
        under[k] = static_cast<unsigned char>(std::lround(over[k] * p.alpha[at] + under[k] * (1 - p.alpha[at])));
    }
  }
}

void write(cv::Mat& page, const std::string& text, int x, int y, double scale = 0.48) {
  cv::putText(page, text, {x, y}, cv::FONT_HERSHEY_SIMPLEX, scale, kInk, 1, cv::LINE_AA);
}

/// Draws a ring around each light in the lens's view, numbered from the strongest.
void mark_lights(cv::Mat& picture, double shrink, const LensParameters& lens, const Lighting& lighting) {
  const CameraModel model(lens);
  int number = 0;
  for (const Light& light : lighting.lights()) {
    ++number;
    const Vec3d d = rotate(lens.pose_cv.rotation.inverse(), vec_cast<double>(light.direction));
    const auto at = model.project(d);
    if (!at) continue;
    const auto [u, v] = tangent_basis(normalized(d));
    const auto rim =
        model.project(normalized(d) + u * std::tan(std::min(1.0, static_cast<double>(light.angular_radius_rad))));
    const double radius = rim ? std::hypot(rim->x - at->x, rim->y - at->y) * shrink : 0;
    const cv::Point centre(static_cast<int>(at->x * shrink), static_cast<int>(at->y * shrink));
    cv::circle(picture, centre, std::max(5, static_cast<int>(radius) + 3), kMark, 1, cv::LINE_AA);
    cv::putText(picture, std::to_string(number), centre + cv::Point(7, -7), cv::FONT_HERSHEY_SIMPLEX, 0.4, kMark, 1,
                cv::LINE_AA);
  }
}

/// Radiance towards `d` with the lights as discs, which radiance(d, 0) does not contain.
Radiance mirror(const Lighting& lighting, Vec3f d) {
  Radiance l = lighting.radiance(d, 0).value;
  for (const Light& light : lighting.lights()) {
    const double rho = std::max(0.02, static_cast<double>(light.angular_radius_rad));
    if (dot(d, light.direction) < std::cos(rho)) continue;
    const auto k = static_cast<float>(1 / cap_vector_irradiance(rho));
    l += {light.irradiance.r * k, light.irradiance.g * k, light.irradiance.b * k};
  }
  return l;
}

struct Row {
  LinearPicture diffuse, glossy, mirror, still;
};

Row lit_by(const Lighting& lighting) {
  const Albedo white{0.8F, 0.8F, 0.8F};
  return {ball(kBallEdge, [&](Vec3f n, Vec3f) { return reflected_radiance(lighting.irradiance(n).value, white); }),
          ball(kBallEdge, [&](Vec3f, Vec3f d) { return lighting.radiance(d, kGlossy).value; }),
          ball(kBallEdge, [&](Vec3f, Vec3f d) { return mirror(lighting, d); }),
          still_life(kStillWidth, kBallEdge, samples_of(lighting))};
}

Row lit_by(const sim::Scene& scene, const sim::SceneState& state) {
  const Albedo white{0.8F, 0.8F, 0.8F};
  const std::vector<LightSample> all = samples_of(scene.panorama(state), state.rotation_world_probe);
  return {ball(kBallEdge, [&](Vec3f n, Vec3f) { return reflected_radiance(diffuse(all, n), white); }),
          ball(kBallEdge, [&](Vec3f, Vec3f d) { return glossy(all, d, kGlossy); }),
          ball(kBallEdge, [&](Vec3f, Vec3f d) { return scene.radiance(vec_cast<double>(d), state); }),
          still_life(kStillWidth, kBallEdge, thinned(all, 1200))};
}

/// The factor that brings the mean luminance of a picture to a quarter of white, which leaves room for highlights.
double exposure_for(const LinearPicture& p) {
  double sum = 0, weight = 0;
  for (std::size_t i = 0; i < p.pixels.size(); ++i) {
    sum += p.alpha[i] * p.pixels[i].luminance();
    weight += p.alpha[i];
  }
  return sum > 0 ? 0.25 * weight / sum : 1;
}

}  // namespace

Status draw_report(const std::string& path, const std::string& title, const sim::Scene& scene,
                   const sim::SceneState& state, const RigParameters& rig, const Lighting& lighting,
                   std::size_t descriptor_bytes, const Evaluation& evaluation) {
  const int row_width = 3 * (kBallEdge + kMargin) + kStillWidth;
  const int lens_width = (row_width - kMargin) / 2;
  const LensParameters& first = rig.lenses.front();
  const int lens_height = lens_width * first.height / first.width;
  const int rows_top = kMargin + 2 * kText + lens_height + kMargin;
  cv::Mat page(rows_top + 2 * (kBallEdge + kText + kMargin) + kText, row_width + 2 * kMargin, CV_8UC3, kPaper);

  std::string map;
  if (const auto environment = lighting.environment()) {
    const int edge = environment->map.levels.front().edge;
    map = formatted(", a map of %dx%d", edge, edge);
  }
  const std::size_t lights = lighting.lights().size();
  const std::string numbers = formatted("%zu light%s, harmonics to band %d%s, %zu bytes; error %.2f %%, bound %.2f %%",
                                        lights, lights == 1 ? "" : "s", lighting.descriptor().radiance.band,
                                        map.c_str(), descriptor_bytes, 100 * evaluation.error, 100 * evaluation.bound);
  write(page, title + ": what the probe sees, and the lights that it found", kMargin, kMargin + kText / 2);
  write(page, numbers, kMargin, kMargin + kText / 2 + kText);

  const Row truth = lit_by(scene, state), answer = lit_by(lighting);
  const double exposure = exposure_for(truth.diffuse);
  for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
    const LensParameters& lens = rig.lenses[k];
    const std::vector<float> seen = sim::render_radiance(scene, state, lens);
    cv::Mat picture(lens.height, lens.width, CV_8UC3);
    for (int y = 0; y < lens.height; ++y)
      for (int x = 0; x < lens.width; ++x) {
        const std::size_t at =
            3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(x));
        picture.at<cv::Vec3b>(y, x) = tone({seen[at], seen[at + 1], seen[at + 2]}, exposure);
      }
    cv::Mat small;
    cv::resize(picture, small, {lens_width, lens_height}, 0, 0, cv::INTER_AREA);
    mark_lights(small, static_cast<double>(lens_width) / lens.width, lens, lighting);
    small.copyTo(page(cv::Rect(kMargin + static_cast<int>(k) * (lens_width + kMargin), kMargin + 2 * kText, lens_width,
                               lens_height)));
  }
  int y = rows_top;
  const auto draw_row = [&](const std::string& caption, const Row& row) {
    write(page, caption, kMargin, y + kText / 2);
    y += kText;
    int x = kMargin;
    for (const LinearPicture* p : {&row.diffuse, &row.glossy, &row.mirror, &row.still}) {
      paste(page, *p, x, y, exposure);
      x += p->width + kMargin;
    }
    y += kBallEdge + kMargin;
  };
  draw_row("lit by the descriptor: matte, glossy (roughness 0.5), mirror; an object with its shadow", answer);
  draw_row("lit by the true panorama", truth);
  cv::cvtColor(page, page, cv::COLOR_BGR2RGB);
  Image image{page.cols, page.rows, PixelFormat::rgb8, {}};
  const auto* const bytes = reinterpret_cast<const std::byte*>(page.data);
  image.data.assign(bytes, bytes + page.total() * page.elemSize());
  return write_png(path, image);
}

}  // namespace lightwell::hil
