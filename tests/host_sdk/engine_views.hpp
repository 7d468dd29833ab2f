// The SDK's conversions, evaluated by reference implementations of the target engines.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/conventions.hpp>

#include "reference/engines/frames.hpp"
#include "reference/vector.hpp"

namespace lightwell::test {

enum class MainLightIs { apart, in_harmonics };

/// A lighting converted to one engine.
struct EngineView {
  std::string name;
  reference::engines::Frame frame;
  MainLightIs main;
  std::function<reference::Rgb(const reference::V3&)> irradiance;  ///< At a unit normal in the engine's axes.
  Validity validity;
  std::optional<float> residual;

  /// Irradiance at a normal in Lightwell's axes.
  [[nodiscard]] reference::Rgb at(const reference::V3& ours) const {
    return irradiance(reference::engines::in_frame(frame, ours.x, ours.y, -ours.z));
  }
};

/// Every target in every variant.
[[nodiscard]] std::vector<EngineView> every_engine(const Lighting& lighting, const ConversionOptions& options = {});

}  // namespace lightwell::test
