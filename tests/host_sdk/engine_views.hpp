// The SDK's conversions, seen by the oracles of the engines that they are for.
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

/// A lighting as one engine shows it.
struct EngineView {
  std::string name;
  reference::engines::Frame frame;
  MainLightIs main;
  std::function<reference::Rgb(const reference::V3&)> irradiance;  ///< At a unit normal in the engine's axes.
  Validity validity;
  std::optional<float> residual;

  /// At a normal in our axes: so far right, up and forward as there.
  [[nodiscard]] reference::Rgb at(const reference::V3& ours) const {
    return irradiance(reference::engines::in_frame(frame, ours.x, ours.y, -ours.z));
  }
};

/// Every target, in every variant that it has.
[[nodiscard]] std::vector<EngineView> every_engine(const Lighting& lighting, const ConversionOptions& options = {});

}  // namespace lightwell::test
