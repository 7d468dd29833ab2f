#include "reference/image_object/mesh_rays.hpp"

#include <algorithm>

#include <embree3/rtcore.h>

namespace lightwell::reference {
namespace {

RTCRay ray_of(const V3& from, const V3& towards, double distance) {
  RTCRay out{};
  out.org_x = static_cast<float>(from.x);
  out.org_y = static_cast<float>(from.y);
  out.org_z = static_cast<float>(from.z);
  out.dir_x = static_cast<float>(towards.x);
  out.dir_y = static_cast<float>(towards.y);
  out.dir_z = static_cast<float>(towards.z);
  out.tfar = static_cast<float>(distance);
  out.mask = 0xFFFFFFFFU;
  return out;
}

}  // namespace

struct MeshRays::Scene {
  RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
  RTCScene scene = rtcNewScene(device);

  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

MeshRays::MeshRays(const SmoothMesh& mesh) : mesh_(mesh), scene_(std::make_unique<Scene>()) {
  const RTCGeometry geometry = rtcNewGeometry(scene_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* to = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                         3 * sizeof(float), mesh.positions.size()));
  for (const V3& p : mesh.positions)
    for (const double v : {p.x, p.y, p.z}) *to++ = static_cast<float>(v);
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) indices = std::copy(triangle.begin(), triangle.end(), indices);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneFlags(scene_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcCommitScene(scene_->scene);
}

MeshRays::~MeshRays() = default;

std::optional<MeshRays::Hit> MeshRays::first_hit(const V3& from, const V3& towards) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = ray_of(from, towards, std::numeric_limits<double>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const auto& triangle = mesh_.triangles[query.hit.primID];
  const V3 &a = mesh_.positions[triangle[0]], &b = mesh_.positions[triangle[1]], &c = mesh_.positions[triangle[2]];
  Hit out;
  out.triangle = query.hit.primID;
  out.facet = normalised(cross(b - a, c - a));
  // The plane of the triangle in double.
  out.at = from + (dot(out.facet, a - from) / dot(out.facet, towards)) * towards;
  const double u = static_cast<double>(query.hit.u), v = static_cast<double>(query.hit.v);
  out.normal = normalised((1 - u - v) * mesh_.normals[triangle[0]] + u * mesh_.normals[triangle[1]] +
                          v * mesh_.normals[triangle[2]]);
  if (dot(out.facet, towards) > 0) out.facet = -1.0 * out.facet;
  if (dot(out.normal, out.facet) < 0) out.normal = -1.0 * out.normal;
  return out;
}

bool MeshRays::occluded(const V3& from, const V3& towards, double distance) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay query = ray_of(from, towards, distance);
  rtcOccluded1(scene_->scene, &context, &query);
  return query.tfar < 0;
}

}  // namespace lightwell::reference
