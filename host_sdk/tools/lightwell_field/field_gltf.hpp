// A light field as a glTF 2.0 file, for engines.
#pragma once

#include <string>

#include <lightwell/field.hpp>
#include <lightwell/result.hpp>

namespace lightwell::tool {

/// Writes the lights of the field as nodes with KHR_lights_punctual: a placed light as a point light (candela), a
/// distant one as a directional light (lux), which shines along its node's -Z. What is not a light of the field, at the
/// middle of the probes, is an environment of EXT_lights_image_based: nine irradiance coefficients and a cube map of
/// one level (PNG in the file, RGBD). The numbers are photometric where the field's units are absolute.
[[nodiscard]] Status write_field_gltf(const LightField& field, HostTime now, const std::string& path);

}  // namespace lightwell::tool
