// Of a build without Embree.
#include "field/proxy.hpp"

namespace lightwell {

bool field_has_geometry() { return false; }

namespace field {

Result<std::shared_ptr<const Proxy>> Proxy::make(const FieldGeometry&) {
  return Status(StatusCode::failed_precondition,
                "this build has no Embree, which proxy geometry needs: build with libembree-dev");
}

bool Proxy::occluded(Vec3d, Vec3d, double) const { return false; }

std::optional<Vec3d> Proxy::surface_at(Vec3d, Vec3d, double) const { return std::nullopt; }

void Proxy::first_texels(Vec3d, std::span<const Vec3f>, std::span<std::uint32_t> out) const {
  for (std::uint32_t& texel : out) texel = kNoTexel;
}

}  // namespace field
}  // namespace lightwell
