#include "reference/marker/marker_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <thread>
#include <utility>

#include "reference/marker/marker_world.hpp"

namespace lightwell::reference {

namespace {

/// A pixel whose samples agree to this relative difference contains no edge.
constexpr double kEven = 0.005;

/// A grid of count² points on the unit square that includes its edges.
std::vector<FacePoint> grid(int count) {
  std::vector<FacePoint> out;
  for (int j = 0; j < count; ++j)
    for (int i = 0; i < count; ++i) out.push_back({i / (count - 1.0), j / (count - 1.0)});
  return out;
}

/// A Fibonacci lattice of at least `least` points: no two share a coordinate, so edges in all directions are well
/// sampled.
std::vector<FacePoint> lattice(int least) {
  int count = 2, turn = 1;
  while (count < least) turn = std::exchange(count, count + turn);
  std::vector<FacePoint> out;
  for (int k = 0; k < count; ++k) out.push_back({(k + 0.5) / count, (k * turn % count + 0.5) / count});
  return out;
}

/// A surface and a cone around it, seen from the camera.
struct Target {
  Surface surface;
  Vec3d axis;
  double least_cosine = -2;  ///< Cosine of the cone's half angle; below -1: all directions.
};

/// The surfaces whose cone is within `reach` rad of a direction.
std::vector<Target> targets_of(const MarkerWorld& world, Vec3d eye, double reach) {
  std::vector<Target> out;
  for (const auto& [surface, bounds] : world.bounded()) {
    const Vec3d to = bounds.center - eye;
    const double distance = length(to);
    if (surface.kind == SurfaceKind::face) {
      const WorldPolygon& face = world.faces()[surface.index];
      if (dot(face.z, eye - face.origin) <= 0) continue;
    }
    Target target{surface, normalized(to), -2};
    if (distance > bounds.radius)
      target.least_cosine = std::cos(std::min(pi, std::asin(bounds.radius / distance) + reach));
    out.push_back(target);
  }
  return out;
}

/// Red channel of a pixel.
std::size_t offset_of(int width, int x, int y) {
  return 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
}

class Rendering {
 public:
  Rendering(const MarkerScene& scene, const MarkerCamera& camera, const RenderOptions& options)
      : world_(scene),
        camera_(camera),
        eye_(camera.centre()),
        first_(grid(std::max(2, options.samples))),
        closer_(lattice(options.edge_rays)) {
    // Lens models are smooth: no pixel's angular size is twice the maximum over a coarse grid.
    double reach = 0;
    const int step = std::max(1, std::min(camera.width(), camera.height()) / 64);
    for (int y = 0; y < camera.height(); y += step)
      for (int x = 0; x < camera.width(); x += step) {
        const auto middle = camera.ray(x, y, 0.5, 0.5);
        for (const double u : {0.0, 1.0})
          if (const auto corner = camera.ray(x, y, u, u); middle && corner)
            reach = std::max(reach, angle_between(*middle, *corner));
      }
    targets_ = targets_of(world_, eye_, 2 * reach);
  }

  /// The surface hit by the ray through a pixel's centre, and the lamps occluded there.
  void classify(int x, int y, std::vector<Surface>& among, Surface& surface, std::uint32_t& shaded) const {
    const std::optional<Vec3d> middle = camera_.ray(x, y, 0.5, 0.5);
    if (!middle) return;
    const Vec3d unit = normalized(*middle);
    candidates(unit, among);
    const SurfaceHit hit = world_.nearest(eye_, unit, among);
    surface = hit.surface;
    if (surface.kind == SurfaceKind::none) return;
    const Vec3d point = eye_ + unit * hit.t, normal = world_.normal_at(surface, point, unit);
    const std::vector<MarkerLamp>& lamps = world_.scene().lamps;
    for (std::size_t k = 0; k < std::min<std::size_t>(32, lamps.size()); ++k) {
      const double all = sum_of(world_.lamp_irradiance(lamps[k], point, normal, {surface, false, false}));
      // Without occlusion both sums are equal; the tolerance exceeds rounding and is below one point of a thousand.
      if (sum_of(world_.lamp_irradiance(lamps[k], point, normal, {surface})) < (1 - 1e-9) * all) shaded |= 1U << k;
    }
  }

  void row(int y, RadiancePicture& out) const {
    std::vector<Surface> among;
    for (int x = 0; x < camera_.width(); ++x) {
      const Rgb mean = pixel(x, y, among);
      float* to = &out.rgb[offset_of(out.width, x, y)];
      for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(mean[c]);
    }
  }

 private:
  static double sum_of(const Rgb& c) { return c[0] + c[1] + c[2]; }

  /// All surfaces that a pixel in this direction can show.
  void candidates(Vec3d unit, std::vector<Surface>& out) const {
    out.clear();
    for (const Target& target : targets_)
      if (dot(unit, target.axis) >= target.least_cosine) out.push_back(target.surface);
    if (world_.scene().table) out.push_back({SurfaceKind::table, 0});
  }

  [[nodiscard]] Rgb pixel(int x, int y, std::vector<Surface>& among) const {
    const std::optional<Vec3d> middle = camera_.ray(x, y, 0.5, 0.5);
    if (!middle) return {};
    const Vec3d unit = normalized(*middle);
    candidates(unit, among);
    const auto& table = world_.scene().table;
    if (among.empty()) return world_.scene().background;

    Rgb table_ambient{};
    if (table) {
      const SurfaceHit hit = world_.nearest(eye_, unit, the_table_);
      table_ambient = hit.surface.kind == SurfaceKind::table ? world_.table_ambient(eye_ + unit * hit.t)
                                                             : world_.ambient(table->normal);
    }
    Rgb least, most;
    Rgb mean = mean_of(first_, x, y, among, table_ambient, {}, least, most);
    bool even = true;
    for (std::size_t c = 0; c < 3; ++c) even = even && most[c] - least[c] <= kEven * most[c];
    // Each pixel's lattice has a different offset (Roberts 2018, the sequence R2), so that errors along an edge are
    // independent.
    const FacePoint shift{std::fmod(0.7548776662466927 * (x + 31 * y), 1),
                          std::fmod(0.5698402909980532 * (x + 31 * y), 1)};
    if (!even) mean = mean_of(closer_, x, y, among, table_ambient, shift, least, most);
    return mean;
  }

  /// std::nullopt if part of the pixel is outside the lens's field.
  [[nodiscard]] Rgb mean_of(const std::vector<FacePoint>& points, int x, int y, const std::vector<Surface>& among,
                            const Rgb& table_ambient, FacePoint shift, Rgb& least, Rgb& most) const {
    least.fill(std::numeric_limits<double>::infinity());
    most.fill(0);
    Rgb sum{};
    for (const FacePoint& p : points) {
      const double u = p.x + shift.x, v = p.y + shift.y;
      const std::optional<Vec3d> ray = camera_.ray(x, y, u > 1 ? u - 1 : u, v > 1 ? v - 1 : v);
      if (!ray) return {};
      const Rgb here = world_.radiance(world_.nearest(eye_, *ray, among), eye_, *ray, table_ambient);
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += here[c];
        least[c] = std::min(least[c], here[c]);
        most[c] = std::max(most[c], here[c]);
      }
    }
    for (double& value : sum) value /= static_cast<double>(points.size());
    return sum;
  }

  MarkerWorld world_;
  const MarkerCamera& camera_;
  Vec3d eye_;
  std::vector<FacePoint> first_, closer_;
  std::vector<Target> targets_;
  std::vector<Surface> the_table_ = {{SurfaceKind::table, 0}};
};

void blur(RadiancePicture& picture, double sigma) {
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  std::vector<double> kernel;
  for (int i = -reach; i <= reach; ++i) kernel.push_back(std::exp(-i * i / (2 * sigma * sigma)));
  const double sum = std::accumulate(kernel.begin(), kernel.end(), 0.0);
  const auto pass = [&](int dx, int dy) {
    const std::vector<float> from = picture.rgb;
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) {
        Rgb mean{};
        for (int i = -reach; i <= reach; ++i) {
          const int px = std::clamp(x + i * dx, 0, picture.width - 1),
                    py = std::clamp(y + i * dy, 0, picture.height - 1);
          const float* p = &from[offset_of(picture.width, px, py)];
          for (std::size_t c = 0; c < 3; ++c) mean[c] += kernel[static_cast<std::size_t>(i + reach)] / sum * p[c];
        }
        const std::size_t at = offset_of(picture.width, x, y);
        for (std::size_t c = 0; c < 3; ++c) picture.rgb[at + c] = static_cast<float>(mean[c]);
      }
  };
  pass(1, 0);
  pass(0, 1);
}

}  // namespace

Rgb RadiancePicture::at(int x, int y) const {
  const std::size_t k = offset_of(width, x, y);
  return {rgb[k], rgb[k + 1], rgb[k + 2]};
}

LensParameters pinhole_lens(int width, int height, double focal_px) {
  LensParameters lens;
  lens.width = width;
  lens.height = height;
  MeiParameters mei;
  mei.fx = mei.fy = focal_px;
  mei.cx = (width - 1) / 2.0;
  mei.cy = (height - 1) / 2.0;
  lens.model = mei;
  // The angle of the outermost corner of the image, with a small margin.
  lens.max_angle_rad = std::min(1.55, std::atan(std::hypot(width / 2.0, height / 2.0) / focal_px) + 0.01);
  lens.pose_cv.rotation = upright_lens_cv();
  return lens;
}

MarkerCamera::MarkerCamera(const LensParameters& lens) : lens_(lens), model_(lens) {
  for (int y = 0; y <= lens.height; ++y)
    for (int x = 0; x <= lens.width; ++x) {
      std::optional<Vec3d> ray = model_.unproject({x - 0.5, y - 0.5});
      // Scaled to length 1 along the axis if possible: then the rays of a pinhole are linear in the pixel.
      if (ray && lens.max_angle_rad < 1.56) *ray = *ray * (1 / ray->z);
      if (ray) *ray = rotate(lens.pose_cv.rotation, *ray);
      rays_.push_back(ray);
    }
}

std::optional<PixelPosition> MarkerCamera::pixel_of(Vec3d point) const {
  return model_.project(transformed(inverse(lens_.pose_cv), point));
}

std::optional<Vec3d> MarkerCamera::ray(int column, int row, double u, double v) const {
  const auto wide = static_cast<std::size_t>(lens_.width) + 1;
  const std::size_t i = static_cast<std::size_t>(row) * wide + static_cast<std::size_t>(column);
  const std::optional<Vec3d>&a = rays_[i], &b = rays_[i + 1], &c = rays_[i + wide], &d = rays_[i + wide + 1];
  if (!a || !b || !c || !d) return std::nullopt;
  return (*a * (1 - u) + *b * u) * (1 - v) + (*c * (1 - u) + *d * u) * v;
}

RadiancePicture render(const MarkerScene& scene, const MarkerCamera& camera, const RenderOptions& options) {
  RadiancePicture out{camera.width(), camera.height(), {}};
  out.rgb.resize(3 * static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  const Rendering rendering(scene, camera, options);
  const int threads = std::max(1, options.threads);
  const auto share = [&](int first) {
    for (int y = first; y < out.height; y += threads) rendering.row(y, out);
  };
  std::vector<std::thread> others;
  for (int k = 1; k < threads; ++k) others.emplace_back(share, k);
  share(0);
  for (std::thread& one : others) one.join();
  if (options.blur_px > 0) blur(out, options.blur_px);
  return out;
}

SurfacePicture see_surfaces(const MarkerScene& scene, const MarkerCamera& camera) {
  SurfacePicture out{camera.width(), camera.height(), {}, {}};
  const std::size_t count = out.index(0, out.height);
  out.surfaces.resize(count);
  out.shaded.resize(count);
  const Rendering rendering(scene, camera, {});
  std::vector<Surface> among;
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      rendering.classify(x, y, among, out.surfaces[out.index(x, y)], out.shaded[out.index(x, y)]);
  return out;
}

std::optional<std::vector<PixelPosition>> outline_pixels(const MarkerScene& scene, const MarkerCamera& camera,
                                                         std::size_t face, const FaceOutline& outline) {
  const Pose at = compose(scene.probe_body, scene.body.faces.at(face).body_face);
  if (dot(rotate(at.rotation, Vec3d{0, 0, 1}), camera.centre() - at.translation) <= 0) return std::nullopt;
  std::vector<PixelPosition> out;
  for (const FacePoint& p : outline) {
    const auto pixel = camera.pixel_of(transformed(at, {p.x, p.y, 0}));
    if (!pixel) return std::nullopt;
    out.push_back(*pixel);
  }
  return out;
}

std::optional<std::array<PixelPosition, 4>> tag_corners(const MarkerScene& scene, const MarkerCamera& camera,
                                                        std::size_t face) {
  const double h = scene.body.tag_size_m / 2;
  const auto out = outline_pixels(scene, camera, face, {{-h, -h}, {h, -h}, {h, h}, {-h, h}});
  if (!out) return std::nullopt;
  return std::array<PixelPosition, 4>{(*out)[0], (*out)[1], (*out)[2], (*out)[3]};
}

}  // namespace lightwell::reference
