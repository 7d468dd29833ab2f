// A file of write_field_grid(), read by the formulas of Unity's documents: it shares no code with what writes it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "reference/engines/renderers.hpp"
#include "reference/vector.hpp"

namespace lightwell::test {

/// Vectors are in Unity's axes: ours with z negated.
struct UnityGridFile {
  explicit UnityGridFile(const std::string& path) {
    std::ifstream file(path);
    document = nlohmann::json::parse(file);
    positions = document.at("positions").get<std::vector<double>>();
    validity = document.at("validity").get<std::vector<int>>();
    flags = document.at("flags").get<std::vector<unsigned>>();
    bound = document.at("bound").get<std::vector<double>>();
    residual = document.at("residual").get<std::vector<double>>();
    harmonics = document.at("sphericalHarmonicsL2").get<std::vector<double>>();
  }

  [[nodiscard]] std::size_t size() const { return validity.size(); }
  [[nodiscard]] reference::V3 position(std::size_t i) const {
    return {positions.at(3 * i), positions.at(3 * i + 1), positions.at(3 * i + 2)};
  }

  /// Irradiance by the harmonics of one probe.
  [[nodiscard]] reference::Rgb irradiance(std::size_t i, const reference::V3& normal) const {
    return irradiance_of(&harmonics.at(27 * i), normal);
  }

  /// By 27 coefficients.
  [[nodiscard]] static reference::Rgb irradiance_of(const double* coefficients, const reference::V3& normal) {
    reference::engines::UnityScene scene;
    for (std::size_t rgb = 0; rgb < 3; ++rgb)
      for (std::size_t k = 0; k < 9; ++k) scene.sh[rgb][k] = coefficients[9 * rgb + k];
    return reference::engines::unity_irradiance(scene, reference::engines::UnityPipeline::universal, normal);
  }

  /// By the lights of the file, as URP shades them: colour times intensity times n.l over the squared distance.
  [[nodiscard]] reference::Rgb irradiance_of_lights(const reference::V3& point, const reference::V3& normal) const {
    reference::Rgb out{};
    for (const auto& light : document.at("lights")) {
      const auto vector = [&](const char* key) {
        const auto v = light.at(key).get<std::array<double, 3>>();
        return reference::V3{v[0], v[1], v[2]};
      };
      const bool placed = light.at("type") == "Point";
      const reference::V3 to = placed ? vector("position") - point : -1.0 * vector("forward");
      const double fall = placed ? 1 / reference::dot(to, to) : 1;
      const double cosine = std::max(0.0, reference::dot(normal, reference::normalised(to)));
      const auto color = light.at("color").get<std::array<double, 3>>();
      for (std::size_t c = 0; c < 3; ++c)
        out[c] += reference::pi * color[c] * light.at("intensity").get<double>() * fall * cosine;
    }
    return out;
  }

  nlohmann::json document;
  std::vector<double> positions, bound, residual, harmonics;
  std::vector<int> validity;
  std::vector<unsigned> flags;
};

}  // namespace lightwell::test
