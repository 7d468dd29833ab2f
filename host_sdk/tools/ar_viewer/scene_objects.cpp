#include "ar_viewer/scene_objects.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "ar_viewer/light_state.hpp"
#include "ar_viewer/scene_fields.hpp"

namespace lightwell::viewer {
namespace {

constexpr Range kRadiance{0, 1e9};

bool is_uri(const std::string& text) {
  return text.find("://") != std::string::npos || text.starts_with("usb:") || text.starts_with("replay:");
}

void read_harmonics(const nlohmann::json& list, Fields& fields, RadianceSh& sh) {
  const std::size_t count = list.is_array() ? list.size() : 0;
  int band = 0;
  while (band < kMaxBand && sh_count(band) < static_cast<int>(count)) ++band;
  if (sh_count(band) != static_cast<int>(count))
    return fields.fail("harmonics",
                       "it is " + excerpt(list) + "; write a list of 1, 4, 9, 16, 25, 36 or 49 coefficients [r, g, b]");
  sh.band = band;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const bool given = list[i].is_array() && list[i].size() == 3 && list[i][c].is_number();
      const double value = given ? list[i][c].get<double>() : 0;
      if (!given || !(std::abs(value) <= kRadiance.most))
        return fields.fail("harmonics[" + std::to_string(i) + "]",
                           "it is " + excerpt(list[i]) + "; write three numbers from -1e9 to 1e9");
      sh.c[i][static_cast<int>(c)] = static_cast<float>(value);
    }
}

Light read_discrete_light(const nlohmann::json& json, const std::string& where, Status& status) {
  Light light;
  Fields fields(json, where, status);
  fields.require("direction");
  fields.require("irradiance");
  std::array<float, 3> direction{}, irradiance{};
  fields.read("direction", std::span<float>(direction), Range{-1e6, 1e6});
  fields.read("irradiance", std::span<float>(irradiance), kRadiance);
  double radius_deg = 0;
  fields.read("angular_radius_deg", radius_deg, Range{0, 90});
  fields.read("distance_m", light.distance_m, Range{1e-3, 1e4});
  fields.refuse_others();
  light.direction = normalized(Vec3f{direction[0], direction[1], direction[2]});
  if (length(light.direction) == 0) fields.fail("direction", "it is zero; write a vector towards the light");
  light.irradiance = {irradiance[0], irradiance[1], irradiance[2]};
  light.angular_radius_rad = static_cast<float>(radius_deg * std::numbers::pi / 180);
  // The SDK has a standard deviation wherever it has a distance.
  light.distance_sigma_m = 0.01F * light.distance_m;
  return light;
}

Material read_material(const nlohmann::json& json, const std::string& where, const std::string& folder,
                       Status& status) {
  const auto preset = [&](const std::string& name, const std::string& field) {
    const auto found = material_preset(name);
    std::string known;
    for (const std::string_view each : material_presets()) known += (known.empty() ? "" : ", ") + std::string(each);
    if (!found && status.ok())
      status = invalid_argument("field " + field + ": '" + name + "' is not known; write one of " + known);
    return found.value_or(Material{});
  };
  if (json.is_string()) return preset(json.get<std::string>(), where);
  Material m;
  Fields fields(json, where, status);
  std::string name;
  fields.read("preset", name);
  if (!name.empty()) m = preset(name, fields.path_of("preset"));
  fields.read("base_color", std::span<float>(m.base_color), kUnitRange);
  for (const auto& [field, weight] : {std::pair{"lambert", &m.lambert}, std::pair{"blinn_phong", &m.blinn_phong},
                                      std::pair{"anisotropic", &m.anisotropic}, std::pair{"reflection", &m.reflection},
                                      std::pair{"refraction", &m.refraction}, std::pair{"fresnel", &m.fresnel},
                                      std::pair{"metal_rough", &m.metal_rough}, std::pair{"metallic", &m.metallic},
                                      std::pair{"roughness", &m.roughness}})
    fields.read(field, *weight, kUnitRange);
  fields.read("shininess", m.shininess, Range{1, 1e4});
  fields.read("n_u", m.n_u, Range{0, 1e4});
  fields.read("n_v", m.n_v, Range{0, 1e4});
  fields.read("ior", m.ior, Range{1, 4});
  fields.read("fresnel_power", m.fresnel_power, Range{1, 10});
  fields.read("normal_scale", m.normal_scale, Range{0, 10});
  for (const auto& [field, path] : {std::pair{"texture", &m.texture}, std::pair{"normal_map", &m.normal_map}}) {
    fields.read_path(field, folder, *path);
  }
  constexpr std::array<std::string_view, 2> kRates = {"fragment", "vertex"};
  auto rate = static_cast<std::size_t>(m.lighting);
  fields.read_choice("lighting", kRates, rate);
  m.lighting = static_cast<LightingRate>(rate);
  fields.refuse_others();
  return m;
}

Object read_object(const nlohmann::json& json, const std::string& where, const std::string& folder, Status& status) {
  Object object;
  Fields fields(json, where, status);
  fields.read("mesh", object.mesh);
  const bool from_file = object.mesh.ends_with(".glb") || object.mesh.ends_with(".gltf");
  if (from_file) fields.read_path("mesh", folder, object.mesh);
  if (!from_file) object.size_m = {0.1};
  const Range size{1e-4, 1e3};
  if (fields.has("size_m")) {
    object.size_m.resize(json.at("size_m").is_array() ? 3 : 1);
    if (object.size_m.size() == 3)
      fields.read("size_m", std::span<double>(object.size_m), size);
    else
      fields.read("size_m", object.size_m[0], size);
  }
  constexpr std::array<std::string_view, 2> kAnchors = {"world", "marker_body"};
  fields.read_choice("anchor", kAnchors, object.anchor);
  fields.read(object.anchor == Anchor::world ? "T_world_object" : "T_body_object", object.T_anchor_object);
  object.material_given = fields.has("material");
  if (const auto* material = fields.member("material"))
    object.material = read_material(*material, fields.path_of("material"), folder, status);
  fields.refuse_others();
  return object;
}

}  // namespace

LightDescription read_light(const nlohmann::json& json, const std::string& where, const std::string& folder,
                            Status& status) {
  if (json.is_string()) {
    const auto text = json.get<std::string>();
    if (is_uri(text)) return LightUri{text};
    const std::string path = path_beside(folder, text);
    if (const std::string problem = missing_file(path); status.ok() && !problem.empty())
      status = invalid_argument("field " + where + ": " + problem);
    return LightFile{path};
  }
  LightValues values;
  Fields fields(json, where, status);
  std::array<float, 3> constant{};
  fields.read("constant", std::span<float>(constant), kRadiance);
  RadianceSh& sh = values.descriptor.radiance;
  sh = uniform_radiance({constant[0], constant[1], constant[2]});
  if (const auto* harmonics = fields.member("harmonics")) {
    if (fields.has("constant")) fields.fail("harmonics", "`constant` gives the same light; remove one of them");
    read_harmonics(*harmonics, fields, sh);
  }
  if (const auto* lights = fields.member("lights")) {
    if (!lights->is_array() || lights->size() > kMaxLights)
      fields.fail("lights",
                  "it is " + excerpt(*lights) + "; write a list of at most " + std::to_string(kMaxLights) + " lights");
    else
      for (std::size_t i = 0; i < lights->size(); ++i)
        values.descriptor.lights.push_back(
            read_discrete_light((*lights)[i], fields.path_of("lights[" + std::to_string(i) + "]"), status));
  }
  fields.refuse_others();
  values.descriptor.coverage = 1;
  return values;
}

std::vector<Object> read_objects(const nlohmann::json& json, const std::string& folder, Status& status) {
  std::vector<Object> objects;
  if (!json.is_array() || json.size() > Scene::kMaxObjects) {
    if (status.ok())
      status = invalid_argument("field objects: it is " + excerpt(json) + "; write a list of at most " +
                                std::to_string(Scene::kMaxObjects) + " objects");
    return objects;
  }
  for (std::size_t i = 0; i < json.size(); ++i)
    objects.push_back(read_object(json[i], "objects[" + std::to_string(i) + "]", folder, status));
  return objects;
}

}  // namespace lightwell::viewer
