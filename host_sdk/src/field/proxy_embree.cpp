#include <algorithm>
#include <cmath>
#include <cstring>

#include <embree3/rtcore.h>

#include "field/proxy.hpp"

namespace lightwell {

bool field_has_geometry() { return true; }

namespace field {

struct Proxy::Scene {
  RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
  RTCScene scene = device != nullptr ? rtcNewScene(device) : nullptr;

  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

Proxy::Proxy() : scene_(std::make_unique<Scene>()) {}
Proxy::~Proxy() = default;

Result<std::shared_ptr<const Proxy>> Proxy::make(const FieldGeometry& geometry) {
  const std::size_t triangles = geometry.indices.size() / 3;
  std::shared_ptr<Proxy> out(new Proxy);
  if (out->scene_->scene == nullptr) return Status(StatusCode::internal, "Embree cannot create a scene");
  RTCGeometry mesh = rtcNewGeometry(out->scene_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* const vertices = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                 geometry.vertices.size());
  void* const indices =
      rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles);
  if (vertices == nullptr || indices == nullptr) {
    rtcReleaseGeometry(mesh);
    return Status(StatusCode::resource_exhausted, "no memory for the proxy geometry");
  }
  std::memcpy(vertices, geometry.vertices.data(), geometry.vertices.size_bytes());
  std::memcpy(indices, geometry.indices.data(), triangles * 3 * sizeof(std::uint32_t));
  rtcCommitGeometry(mesh);
  rtcAttachGeometry(out->scene_->scene, mesh);
  rtcReleaseGeometry(mesh);
  rtcCommitScene(out->scene_->scene);

  const auto corner = [&](std::size_t triangle, std::size_t k) {
    return vec_cast<double>(geometry.vertices[geometry.indices[3 * triangle + k]]);
  };
  const auto edge_of = [&](std::size_t t, double texel) {
    const double longest = std::max({length(corner(t, 1) - corner(t, 0)), length(corner(t, 2) - corner(t, 0)),
                                     length(corner(t, 2) - corner(t, 1))});
    return static_cast<std::uint32_t>(std::clamp(std::ceil(longest / texel), 1.0, 64.0));
  };
  // Larger texels where there would be too many; one each in the end.
  double texel = kTexel_m;
  for (std::size_t total = kMaxTexels + 1; texel < 1e6; texel *= 1.5) {
    total = 0;
    for (std::size_t t = 0; t < triangles; ++t) total += std::size_t{1} * edge_of(t, texel) * edge_of(t, texel);
    if (total <= std::max(kMaxTexels, triangles)) break;
  }
  for (std::size_t t = 0; t < triangles; ++t) {
    const std::uint32_t edge = edge_of(t, texel);
    out->triangles_.push_back({static_cast<std::uint32_t>(out->texels_.size()), edge});
    const Vec3d a = corner(t, 0), ab = corner(t, 1) - a, ac = corner(t, 2) - a;
    for (std::uint32_t row = 0; row < edge; ++row)
      for (std::uint32_t column = 0; column < edge; ++column) {
        double u = (column + 0.5) / edge, v = (row + 0.5) / edge;
        if (const double sum = u + v; sum > 0.95) u *= 0.95 / sum, v *= 0.95 / sum;
        out->texels_.push_back(a + ab * u + ac * v);
      }
  }
  return std::shared_ptr<const Proxy>(std::move(out));
}

namespace {

/// `direction` is a unit vector.
RTCRay ray_of(Vec3d origin, Vec3d direction, double near, double far) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x);
  ray.org_y = static_cast<float>(origin.y);
  ray.org_z = static_cast<float>(origin.z);
  ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  ray.tnear = static_cast<float>(near);
  ray.tfar = static_cast<float>(far);
  ray.mask = 0xFFFFFFFF;
  return ray;
}

}  // namespace

bool Proxy::occluded(Vec3d from, Vec3d to, double margin_m) const {
  const Vec3d gap = to - from;
  const double distance = length(gap);
  if (!(distance > 2 * margin_m)) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = ray_of(from, gap * (1 / distance), margin_m, distance - margin_m);
  rtcOccluded1(scene_->scene, &context, &ray);
  return ray.tfar < 0;
}

std::optional<Vec3d> Proxy::surface_at(Vec3d at, Vec3d from, double reach_m) const {
  const Vec3d gap = at - from;
  const double distance = length(gap);
  if (!(distance > reach_m)) return std::nullopt;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit hit{};
  hit.ray = ray_of(from, gap * (1 / distance), 1e-4, distance + reach_m);
  hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_->scene, &context, &hit);
  if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID || static_cast<double>(hit.ray.tfar) < distance - reach_m)
    return std::nullopt;
  const Vec3d normal = normalized(Vec3d{hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z});
  return dot(normal, gap) > 0 ? -normal : normal;
}

void Proxy::first_texels(Vec3d origin, std::span<const Vec3f> directions, std::span<std::uint32_t> out) const {
  constexpr std::size_t kLanes = 16;
  alignas(64) std::array<int, kLanes> valid;
  valid.fill(-1);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (std::size_t first = 0; first + kLanes <= directions.size(); first += kLanes) {
    RTCRayHit16 rays;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const Vec3f& d = directions[first + k];
      rays.ray.org_x[k] = static_cast<float>(origin.x);
      rays.ray.org_y[k] = static_cast<float>(origin.y);
      rays.ray.org_z[k] = static_cast<float>(origin.z);
      rays.ray.dir_x[k] = d.x;
      rays.ray.dir_y[k] = d.y;
      rays.ray.dir_z[k] = d.z;
      rays.ray.tnear[k] = 1e-4F;
      rays.ray.tfar[k] = 1e6F;
      rays.ray.time[k] = 0;
      rays.ray.mask[k] = 0xFFFFFFFF;
      rays.ray.id[k] = 0;
      rays.ray.flags[k] = 0;
      rays.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
      rays.hit.primID[k] = RTC_INVALID_GEOMETRY_ID;
      rays.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect16(valid.data(), scene_->scene, &context, &rays);
    for (std::size_t k = 0; k < kLanes; ++k) {
      out[first + k] = kNoTexel;
      if (rays.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
      const Triangle& triangle = triangles_[rays.hit.primID[k]];
      const auto cell = [&](float barycentric) {
        const float scaled = std::max(barycentric, 0.0F) * static_cast<float>(triangle.edge);
        return std::min(static_cast<std::uint32_t>(scaled), triangle.edge - 1);
      };
      out[first + k] = triangle.first + cell(rays.hit.v[k]) * triangle.edge + cell(rays.hit.u[k]);
    }
  }
}

}  // namespace field
}  // namespace lightwell
