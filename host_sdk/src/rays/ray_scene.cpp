#include "rays/ray_scene.hpp"

#include <cstring>
#include <limits>

#include <embree3/rtcore.h>

namespace lightwell::rays {
namespace {

RTCRay ray_of(Vec3f origin, Vec3f direction, float distance) {
  RTCRay ray{};
  ray.org_x = origin.x;
  ray.org_y = origin.y;
  ray.org_z = origin.z;
  ray.dir_x = direction.x;
  ray.dir_y = direction.y;
  ray.dir_z = direction.z;
  ray.tfar = distance;
  ray.mask = 0xFFFFFFFF;
  return ray;
}

}  // namespace

struct RayScene::Scene {
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

RayScene::RayScene() : scene_(std::make_unique<Scene>()) {}
RayScene::~RayScene() = default;

Result<std::shared_ptr<const RayScene>> RayScene::make(std::span<const Vec3f> vertices,
                                                       std::span<const std::uint32_t> indices) {
  std::shared_ptr<RayScene> out(new RayScene);
  if (out->scene_->scene == nullptr) return Status(StatusCode::internal, "Embree cannot create a scene");
  if (!indices.empty()) {
    RTCGeometry mesh = rtcNewGeometry(out->scene_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* const to_vertices =
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), vertices.size());
    void* const to_indices = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                     3 * sizeof(std::uint32_t), indices.size() / 3);
    if (to_vertices == nullptr || to_indices == nullptr) {
      rtcReleaseGeometry(mesh);
      return Status(StatusCode::resource_exhausted, "no memory for the geometry");
    }
    std::memcpy(to_vertices, vertices.data(), vertices.size_bytes());
    std::memcpy(to_indices, indices.data(), indices.size_bytes());
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(out->scene_->scene, mesh);
    rtcReleaseGeometry(mesh);
  }
  // Rays between the triangles of a closed surface would see through it.
  rtcSetSceneFlags(out->scene_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcCommitScene(out->scene_->scene);
  if (rtcGetDeviceError(out->scene_->device) != RTC_ERROR_NONE)
    return Status(StatusCode::resource_exhausted, "Embree cannot build the geometry: give fewer triangles");
  return std::shared_ptr<const RayScene>(std::move(out));
}

std::optional<RayScene::Hit> RayScene::first_hit(Vec3f origin, Vec3f direction) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = ray_of(origin, direction, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const Vec3f normal = normalized(Vec3f{query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z});
  return Hit{query.ray.tfar, dot(normal, direction) > 0 ? -normal : normal};
}

void RayScene::first_hits(Vec3f origin, std::span<const Vec3f, kLanes> directions, Hits& out) const {
  constexpr float kNearest_m = 1e-4F;
  alignas(64) std::array<int, kLanes> valid;
  valid.fill(-1);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit16 rays;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const Vec3f& d = directions[k];
    rays.ray.org_x[k] = origin.x;
    rays.ray.org_y[k] = origin.y;
    rays.ray.org_z[k] = origin.z;
    rays.ray.dir_x[k] = d.x;
    rays.ray.dir_y[k] = d.y;
    rays.ray.dir_z[k] = d.z;
    rays.ray.tnear[k] = kNearest_m;
    rays.ray.tfar[k] = std::numeric_limits<float>::infinity();
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
    out.triangle[k] = rays.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? kNoTriangle : rays.hit.primID[k];
    out.u[k] = rays.hit.u[k];
    out.v[k] = rays.hit.v[k];
  }
}

bool RayScene::occluded(Vec3f origin, Vec3f direction, float distance) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = ray_of(origin, direction, distance);
  rtcOccluded1(scene_->scene, &context, &ray);
  return ray.tfar < 0;
}

}  // namespace lightwell::rays
