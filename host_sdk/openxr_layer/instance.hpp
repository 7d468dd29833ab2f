// State of one XrInstance.
#pragma once

#include <utility>

#include "configuration.hpp"
#include "light_source.hpp"
#include "messages.hpp"
#include "runtime.hpp"
#include "runtime_clock.hpp"

namespace lightwell::xr {

/// Whether the application has enabled an extension.
enum class Extension : bool { disabled, enabled };

struct Instance {
  Instance(const Runtime& below, Configuration read) : runtime(below), configuration(std::move(read)) {}

  const Runtime runtime;
  Extension light_estimation = Extension::disabled;
  Extension cubemap = Extension::disabled;  ///< Only together with light_estimation.
  const Configuration configuration;        ///< From here on unused where light_estimation is disabled.
  Messages messages{runtime};
  RuntimeClock clock{runtime};
  LightSource source{configuration, messages};

  [[nodiscard]] bool serves() const { return light_estimation == Extension::enabled; }
  [[nodiscard]] bool serves_cubemap() const { return cubemap == Extension::enabled; }
  /// XrSystemLightEstimationPropertiesANDROID::supportsLightEstimation.
  [[nodiscard]] bool supported() const { return configuration.error.empty(); }
};

}  // namespace lightwell::xr
