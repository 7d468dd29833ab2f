#include "field_gltf.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <numbers>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/harmonics.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

using nlohmann::ordered_json;

constexpr int kEdge = 16;  // Texels of a face of the cube map; harmonics hold no more.

/// Direction of the texel in column i, row j of a face, in the order of cube maps: +X, -X, +Y, -Y, +Z, -Z (OpenGL 4.6,
/// table 8.19).
Vec3f texel_direction(int face, int i, int j) {
  const float s = 2 * (static_cast<float>(i) + 0.5F) / kEdge - 1, t = 2 * (static_cast<float>(j) + 0.5F) / kEdge - 1;
  switch (face) {
    case 0:
      return normalized(Vec3f{1, -t, -s});
    case 1:
      return normalized(Vec3f{-1, -t, s});
    case 2:
      return normalized(Vec3f{s, 1, t});
    case 3:
      return normalized(Vec3f{s, -1, -t});
    case 4:
      return normalized(Vec3f{s, -t, 1});
    default:
      return normalized(Vec3f{-s, -t, -1});
  }
}

void put_big_endian(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>(value >> static_cast<unsigned>(shift)));
}

/// CRC-32 of ISO 3309, as PNG requires (RFC 2083, section 3.4).
std::uint32_t crc_32(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0);
  }
  return crc ^ 0xFFFFFFFF;
}

void put_chunk(std::string& out, std::string_view type, std::string_view data) {
  put_big_endian(out, static_cast<std::uint32_t>(data.size()));
  const std::string body = std::string(type) + std::string(data);
  out += body;
  put_big_endian(out, crc_32(body));
}

/// A PNG of kEdge x kEdge RGBA texels, not compressed (stored blocks of RFC 1951).
std::string png(const std::vector<std::uint8_t>& rgba) {
  std::string rows;
  for (int j = 0; j < kEdge; ++j) {
    rows.push_back(0);  // Filter: none.
    rows.append(reinterpret_cast<const char*>(rgba.data()) + std::ptrdiff_t{4} * kEdge * j, 4 * kEdge);
  }
  std::uint32_t a = 1, b = 0;  // Adler-32 (RFC 1950).
  for (const char byte : rows) {
    a = (a + static_cast<unsigned char>(byte)) % 65521;
    b = (b + a) % 65521;
  }
  const auto size = static_cast<std::uint32_t>(rows.size());
  std::string stream{'\x78', '\x01', '\x01'};
  for (const std::uint32_t part : {size & 0xFFU, size >> 8U, ~size & 0xFFU, ~size >> 8U & 0xFFU})
    stream.push_back(static_cast<char>(part));
  stream += rows;
  put_big_endian(stream, b << 16U | a);
  std::string header;
  put_big_endian(header, kEdge);
  put_big_endian(header, kEdge);
  header += std::string("\x08\x06\x00\x00\x00", 5);  // 8 bits, RGBA.
  std::string out = "\x89PNG\r\n\x1a\n";
  put_chunk(out, "IHDR", header);
  put_chunk(out, "IDAT", stream);
  put_chunk(out, "IEND", {});
  return out;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out.push_back(k <= bytes.size() - i ? kDigits[group >> (18 - 6 * k) & 63U] : '=');
  }
  return out;
}

/// RGBD: the colour is rgb / a, in units of `intensity`.
void put_rgbd(std::vector<std::uint8_t>& out, Radiance color, float intensity) {
  const float largest = std::max({color.r, color.g, color.b, 0.0F}) / intensity;
  const float divisor = std::clamp(largest > 1 ? 1 / largest : 1.0F, 1 / 255.0F, 1.0F);
  const auto alpha = static_cast<std::uint8_t>(std::floor(255 * divisor));
  for (int c = 0; c < 3; ++c) {
    const float value = std::max(color[c], 0.0F) / intensity * static_cast<float>(alpha);
    out.push_back(static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F)));
  }
  out.push_back(alpha);
}

/// The rotation that turns -Z to `d`.
ordered_json rotation_to(Vec3f d) {
  // Half-way construction; opposite directions turn about +Y.
  if (d.z > 0.999999F) return {0, 1, 0, 0};
  const Vec3f axis = cross(Vec3f{0, 0, -1}, d);
  const Quat q = Quat{axis.x, axis.y, axis.z, 1 - static_cast<double>(d.z)}.normalized();
  return {q.x, q.y, q.z, q.w};
}

ordered_json light_of(const FieldLight& light, double& intensity) {
  const float largest = std::max({light.intensity.r, light.intensity.g, light.intensity.b, 1e-20F});
  const ordered_json color{std::max(light.intensity.r / largest, 0.0F), std::max(light.intensity.g / largest, 0.0F),
                           std::max(light.intensity.b / largest, 0.0F)};
  intensity = static_cast<double>(largest);
  return {{"name", "light " + std::to_string(light.id)},
          {"type", light.placed ? "point" : "directional"},
          {"color", color},
          {"intensity", largest}};
}

}  // namespace

Status write_field_gltf(const LightField& field, HostTime now, const std::string& path) {
  const auto state = field.state();
  Vec3d middle{};
  for (const FieldProbe& probe : state->probes)
    middle += probe.position * (1.0 / static_cast<double>(state->probes.size()));
  const FieldAnswer answer = field.at(middle, now);
  if (answer.light.validity() == Validity::none)
    return {StatusCode::failed_precondition, path + ": the field has no probe whose light it could write"};

  ordered_json lights = ordered_json::array(), nodes = ordered_json::array(), indices = ordered_json::array();
  for (const FieldLight& light : state->lights) {
    double intensity = 0;
    lights.push_back(light_of(light, intensity));
    ordered_json node{{"name", lights.back()["name"]},
                      {"extensions", {{"KHR_lights_punctual", {{"light", lights.size() - 1}}}}}};
    if (light.placed)
      node["translation"] = {light.position.x, light.position.y, light.position.z};
    else
      node["rotation"] = rotation_to(-light.direction);
    indices.push_back(nodes.size());
    nodes.push_back(std::move(node));
  }

  const RadianceSh& rest = answer.light.descriptor().radiance;
  const float level = std::max(rest.c[0].luminance() * 0.282095F, 1e-20F);
  ordered_json images = ordered_json::array(), faces = ordered_json::array();
  for (int face = 0; face < 6; ++face) {
    std::vector<std::uint8_t> rgba;
    for (int j = 0; j < kEdge; ++j)
      for (int i = 0; i < kEdge; ++i) put_rgbd(rgba, evaluate(rest, texel_direction(face, i, j)), level);
    faces.push_back(images.size());
    images.push_back({{"mimeType", "image/png"}, {"uri", "data:image/png;base64," + base64(png(rgba))}});
  }
  const IrradianceSh irradiance = irradiance_of(rest);
  ordered_json coefficients = ordered_json::array();
  for (std::size_t i = 0; i < 9; ++i)
    coefficients.push_back({irradiance.c[i].r / level, irradiance.c[i].g / level, irradiance.c[i].b / level});

  ordered_json document{{"asset", {{"version", "2.0"}, {"generator", "lightwell field"}}}};
  document["extensionsUsed"] = {"EXT_lights_image_based"};
  document["extensions"]["EXT_lights_image_based"]["lights"] = {{{"intensity", level},
                                                                 {"irradianceCoefficients", std::move(coefficients)},
                                                                 {"specularImageSize", kEdge},
                                                                 {"specularImages", {std::move(faces)}}}};
  document["images"] = std::move(images);
  ordered_json scene{{"extensions", {{"EXT_lights_image_based", {{"light", 0}}}}}};
  if (!lights.empty()) {
    document["extensionsUsed"].push_back("KHR_lights_punctual");
    document["extensions"]["KHR_lights_punctual"] = {{"lights", std::move(lights)}};
    document["nodes"] = std::move(nodes);
    scene["nodes"] = std::move(indices);
  }
  document["scenes"] = {std::move(scene)};
  document["scene"] = 0;
  std::ofstream file(path, std::ios::binary);
  file << json_text(document) << '\n';
  if (!file.flush()) return {StatusCode::unavailable, path + " cannot be written"};
  return {};
}

}  // namespace lightwell::tool
