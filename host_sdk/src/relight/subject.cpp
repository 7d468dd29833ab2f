#include "relight/subject.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace lightwell {
namespace relight {
namespace {

/// Farther points count as no geometry: squares would leave the range of float.
constexpr float kMaxDistance_m = 1e12F;
/// Sub-pixels of a mixed pixel in each direction.
constexpr int kSubPixels = 4;
/// A step of depth to a neighbour, in widths of a pixel, from which on a pixel is mixed.
constexpr float kMaxDepthStep_px = 2;

/// Direction of a point of the picture in the world, with a length of 1 along the camera's axis.
Vec3f picture_ray(const RelightCamera& camera, double x_px, double y_px) {
  const Vec3d ray{(x_px - camera.centre_x_px) / camera.focal_px, -(y_px - camera.centre_y_px) / camera.focal_px, -1};
  return vec_cast<float>(rotate(camera.T_world_camera.rotation, ray));
}

Vec3f pixel_ray(const RelightCamera& camera, int column, int row) {
  return picture_ray(camera, column + 0.5, row + 0.5);
}

Status check_pixels(const SubjectPixels& pixels, std::size_t count) {
  if (!pixels.albedo.empty())
    if (const Status status = check_size("albedo", pixels.albedo.size(), count); !status.ok()) return status;
  if (!pixels.normals.empty())
    if (const Status status = check_size("normals", pixels.normals.size(), count); !status.ok()) return status;
  for (std::size_t p = 0; p < pixels.albedo.size(); ++p) {
    const Albedo& a = pixels.albedo[p];
    if (!std::isfinite(a.r + a.g + a.b) || std::min({a.r, a.g, a.b}) < 0)
      return invalid_argument("albedo of pixel " + std::to_string(p) + " is negative or not finite");
  }
  for (std::size_t p = 0; p < pixels.normals.size(); ++p)
    if (!is_finite(pixels.normals[p]))
      return invalid_argument("normal of pixel " + std::to_string(p) + " is not finite");
  return {};
}

/// Albedo and shading normals.
void set_pixels(SubjectData& data, const SubjectPixels& pixels) {
  const std::size_t count = data.depth.size();
  data.albedo.assign(count, {});
  data.normals = data.facets;
  double sum[3] = {}, seen = 0;
  for (std::size_t p = 0; p < count; ++p) {
    if (!data.has_geometry(p)) continue;
    if (!pixels.albedo.empty()) {
      const Albedo& a = pixels.albedo[p];
      data.albedo[p] = {std::min(a.r, 1.0F), std::min(a.g, 1.0F), std::min(a.b, 1.0F)};
      sum[0] += static_cast<double>(data.albedo[p].r);
      sum[1] += static_cast<double>(data.albedo[p].g);
      sum[2] += static_cast<double>(data.albedo[p].b);
      ++seen;
    }
    if (pixels.normals.empty()) continue;
    if (const Vec3f normal = normalized(pixels.normals[p]); dot(normal, normal) > 0) data.normals[p] = normal;
  }
  if (seen > 0)
    data.mean_albedo = {static_cast<float>(sum[0] / seen), static_cast<float>(sum[1] / seen),
                        static_cast<float>(sum[2] / seen)};
}

/// Positions, normals of the geometry and their statistics, from data.depth.
void set_geometry(SubjectData& data) {
  const RelightCamera& camera = data.camera;
  const std::size_t count = camera.pixels();
  const auto columns = static_cast<std::size_t>(camera.columns), rows = static_cast<std::size_t>(camera.rows);
  const Vec3f eye = vec_cast<float>(camera.T_world_camera.translation);
  data.positions.assign(count, {});
  data.facets.assign(count, {});
  Vec3d sum;
  for (std::size_t p = 0; p < count; ++p) {
    const Vec3f ray = pixel_ray(camera, static_cast<int>(p % columns), static_cast<int>(p / columns));
    if (!data.has_geometry(p) || !(length(ray) * data.depth[p] < kMaxDistance_m)) {
      data.depth[p] = 0;
      ++data.without_geometry;
      continue;
    }
    data.positions[p] = eye + ray * data.depth[p];
    sum += vec_cast<double>(data.positions[p]);
  }
  if (count > data.without_geometry) data.centre = sum * (1.0 / static_cast<double>(count - data.without_geometry));
  // Differences between the neighbours that are the same surface, else towards the pixel itself.
  const auto difference = [&](std::size_t p, bool before, bool after, std::size_t stride) {
    const std::size_t a = before && data.same_surface(p, p - stride) ? p - stride : p;
    const std::size_t b = after && data.same_surface(p, p + stride) ? p + stride : p;
    return data.positions[b] - data.positions[a];
  };
  for (std::size_t p = 0; p < count; ++p) {
    if (!data.has_geometry(p)) continue;
    const std::size_t column = p % columns, row = p / columns;
    const Vec3f to_eye = normalized(eye - data.positions[p]);
    const Vec3f normal = normalized(
        cross(difference(p, row > 0, row + 1 < rows, columns), difference(p, column > 0, column + 1 < columns, 1)));
    data.facets[p] = dot(normal, normal) > 0 ? (dot(normal, to_eye) < 0 ? -normal : normal) : to_eye;
  }
}

/// Calls use(neighbour) for the up to eight pixels around one.
template <class Use>
void each_neighbour(const RelightCamera& camera, std::size_t pixel, const Use& use) {
  const int column = static_cast<int>(pixel) % camera.columns, row = static_cast<int>(pixel) / camera.columns;
  for (int j = std::max(row - 1, 0); j <= std::min(row + 1, camera.rows - 1); ++j)
    for (int i = std::max(column - 1, 0); i <= std::min(column + 1, camera.columns - 1); ++i)
      if (const std::size_t other = static_cast<std::size_t>(j * camera.columns + i); other != pixel) use(other);
}

/// What rays between a mixed pixel's edges see, with the albedo of the neighbour nearest in depth.
void add_mixed_pixel(SubjectData& data, const RayScene& rays, std::size_t pixel) {
  const RelightCamera& camera = data.camera;
  const Vec3f eye = vec_cast<float>(camera.T_world_camera.translation);
  MixedPixel mixed{pixel, data.sub_pixels.size(), 0};
  for (int s = 0; s < kSubPixels * kSubPixels; ++s) {
    const double x =
        static_cast<double>(pixel % static_cast<std::size_t>(camera.columns)) + (s % kSubPixels + 0.5) / kSubPixels;
    const double y =
        static_cast<double>(pixel / static_cast<std::size_t>(camera.columns)) + (s / kSubPixels + 0.5) / kSubPixels;
    const Vec3f ray = picture_ray(camera, x, y);
    const auto hit = rays.first_hit(eye, ray);
    if (!hit || !(hit->distance > 0 && hit->distance < kMaxDistance_m)) continue;
    std::size_t like = pixel;
    each_neighbour(camera, pixel, [&](std::size_t other) {
      if (data.has_geometry(other) &&
          std::abs(data.depth[other] - hit->distance) < std::abs(data.depth[like] - hit->distance))
        like = other;
    });
    data.sub_pixels.push_back({eye + ray * hit->distance, hit->normal, like});
    ++mixed.count;
  }
  data.mixed.push_back(mixed);
}

void set_mixed_pixels(SubjectData& data, const RayScene& rays) {
  for (std::size_t p = 0; p < data.depth.size(); ++p) {
    if (!data.has_geometry(p)) continue;
    bool beside_step = false;
    each_neighbour(data.camera, p, [&](std::size_t other) {
      beside_step = beside_step || std::abs(data.depth[other] - data.depth[p]) > kMaxDepthStep_px * data.pixel_size(p);
    });
    if (beside_step) add_mixed_pixel(data, rays, p);
  }
}

std::shared_ptr<const SubjectSurface> surface_of_depth(const SubjectData& data) {
  const auto columns = static_cast<std::size_t>(data.camera.columns), rows = static_cast<std::size_t>(data.camera.rows);
  std::vector<std::uint32_t> indices;
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    if (!data.same_surface(a, b) || !data.same_surface(b, c) || !data.same_surface(a, c)) return;
    for (const std::size_t p : {a, b, c}) indices.push_back(static_cast<std::uint32_t>(p));
  };
  for (std::size_t row = 0; row + 1 < rows; ++row)
    for (std::size_t column = 0; column + 1 < columns; ++column) {
      const std::size_t p = row * columns + column;
      add(p, p + columns, p + 1);
      add(p + 1, p + columns, p + columns + 1);
    }
  return std::make_shared<SubjectSurface>(data.positions, std::move(indices), SurfaceExtent::seen_side);
}

}  // namespace

Status check_size(const std::string& name, std::size_t size, std::size_t pixels) {
  if (size == pixels) return {};
  return invalid_argument(name + " has " + std::to_string(size) + " values, the camera has " + std::to_string(pixels) +
                          " pixels");
}

Result<std::shared_ptr<const RayScene>> SubjectSurface::rays() const {
  std::call_once(built_, [this] { status_ = RayScene::make(vertices_, indices_).assign_to(rays_); });
  if (!status_.ok()) return status_;
  return rays_;
}

bool SubjectData::same_surface(std::size_t a, std::size_t b) const {
  const double da = static_cast<double>(depth[a]), db = static_cast<double>(depth[b]);
  return da > 0 && db > 0 && std::abs(da - db) <= RelightSubject::kMaxSlope / camera.focal_px * std::min(da, db);
}

std::optional<Projection> SubjectData::project(Vec3f world) const {
  const Vec3d p =
      rotate(camera.T_world_camera.rotation.inverse(), vec_cast<double>(world) - camera.T_world_camera.translation);
  if (!(p.z < 0)) return std::nullopt;
  const double column = std::floor(camera.centre_x_px + camera.focal_px * p.x / -p.z);
  const double row = std::floor(camera.centre_y_px - camera.focal_px * p.y / -p.z);
  if (!(column >= 0 && column < camera.columns && row >= 0 && row < camera.rows)) return std::nullopt;
  return Projection{
      static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.columns) + static_cast<std::size_t>(column),
      static_cast<float>(-p.z)};
}

bool SubjectData::is_near(Vec3f world, const Projection& seen) const {
  // Within two pixels of its tangent plane, and as near as the steepest surface allows.
  const float off_plane = dot(facets[seen.pixel], world - positions[seen.pixel]);
  return std::abs(off_plane) < 2 * pixel_size(seen.pixel) &&
         static_cast<double>(std::abs(seen.depth - depth[seen.pixel])) <=
             RelightSubject::kMaxSlope * static_cast<double>(pixel_size(seen.pixel));
}

}  // namespace relight

Status RelightCamera::validate() const {
  const auto bad = [](const std::string& name, double value, const std::string& asked) {
    return invalid_argument("camera: " + name + " is " + std::to_string(value) + ", it must be " + asked);
  };
  if (columns < 1 || columns > kMaxSide) return bad("columns", columns, "1 to 4096");
  if (rows < 1 || rows > kMaxSide) return bad("rows", rows, "1 to 4096");
  if (!(focal_px > 0) || !std::isfinite(focal_px)) return bad("focal_px", focal_px, "above 0");
  if (!std::isfinite(centre_x_px)) return bad("centre_x_px", centre_x_px, "finite");
  if (!std::isfinite(centre_y_px)) return bad("centre_y_px", centre_y_px, "finite");
  const Quat& q = T_world_camera.rotation;
  const double norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!(length(T_world_camera.translation) <= 1e9) || !(std::abs(norm - 1) < 1e-6))
    return invalid_argument("camera: T_world_camera is not finite, above 1e9 m, or its rotation no unit quaternion");
  return {};
}

Result<RelightSubject> RelightSubject::from_depth(const RelightCamera& camera, std::span<const float> depth_m,
                                                  const SubjectPixels& pixels) {
  if (Status status = camera.validate(); !status.ok()) return status;
  if (Status status = relight::check_size("depth", depth_m.size(), camera.pixels()); !status.ok()) return status;
  if (Status status = relight::check_pixels(pixels, camera.pixels()); !status.ok()) return status;
  auto data = std::make_shared<relight::SubjectData>();
  data->camera = camera;
  data->depth.assign(depth_m.begin(), depth_m.end());
  for (float& d : data->depth)
    if (!(d > 0 && d < relight::kMaxDistance_m)) d = 0;
  relight::set_geometry(*data);
  data->surface = relight::surface_of_depth(*data);
  relight::set_pixels(*data, pixels);
  return RelightSubject(std::move(data));
}

Result<RelightSubject> RelightSubject::from_mesh(const RelightCamera& camera, const RelightMesh& mesh,
                                                 const SubjectPixels& pixels) {
  if (Status status = camera.validate(); !status.ok()) return status;
  if (Status status = relight::check_pixels(pixels, camera.pixels()); !status.ok()) return status;
  if (mesh.indices.size() % 3 != 0) return invalid_argument("mesh: the number of indices is no multiple of 3");
  if (mesh.indices.size() / 3 > RelightMesh::kMaxTriangles || mesh.vertices.size() > 3 * RelightMesh::kMaxTriangles)
    return Status(StatusCode::resource_exhausted,
                  "mesh: more than " + std::to_string(RelightMesh::kMaxTriangles) + " triangles: simplify it");
  for (const Vec3f& v : mesh.vertices)
    if (!is_finite(v)) return invalid_argument("mesh: a vertex is not finite");
  for (const std::uint32_t i : mesh.indices)
    if (i >= mesh.vertices.size()) return invalid_argument("mesh: index " + std::to_string(i) + " is out of range");
  auto data = std::make_shared<relight::SubjectData>();
  data->camera = camera;
  data->surface = std::make_shared<relight::SubjectSurface>(
      std::vector<Vec3f>(mesh.vertices.begin(), mesh.vertices.end()),
      std::vector<std::uint32_t>(mesh.indices.begin(), mesh.indices.end()), relight::SurfaceExtent::whole);
  auto rays = data->surface->rays();
  if (!rays) return rays.status();
  const Vec3f eye = vec_cast<float>(camera.T_world_camera.translation);
  data->depth.assign(camera.pixels(), 0);
  for (int row = 0; row < camera.rows; ++row)
    for (int column = 0; column < camera.columns; ++column)
      if (const auto hit = (*rays)->first_hit(eye, relight::pixel_ray(camera, column, row)))
        if (hit->distance > 0 && hit->distance < relight::kMaxDistance_m)
          data->depth[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.columns) +
                      static_cast<std::size_t>(column)] = hit->distance;
  relight::set_geometry(*data);
  relight::set_mixed_pixels(*data, **rays);
  relight::set_pixels(*data, pixels);
  return RelightSubject(std::move(data));
}

Result<RelightSubject> RelightSubject::with(const SubjectPixels& pixels) const {
  if (Status status = relight::check_pixels(pixels, camera().pixels()); !status.ok()) return status;
  auto data = std::make_shared<relight::SubjectData>(*data_);
  relight::set_pixels(*data, pixels);
  return RelightSubject(std::move(data));
}

const RelightCamera& RelightSubject::camera() const { return data_->camera; }
std::span<const float> RelightSubject::depth_m() const { return data_->depth; }
std::span<const Vec3f> RelightSubject::normals() const { return data_->normals; }
std::size_t RelightSubject::pixels_without_geometry() const { return data_->without_geometry; }

}  // namespace lightwell
