// examples/unreal_light against the C ABI, by a recording. usage: unreal_light_test RECORDING
#include <chrono>
#include <cmath>
#include <string>
#include <thread>

#include <lightwell/conventions.h>

#include "Components/DirectionalLightComponent.h"
#include "Components/SkyLightComponent.h"
#include "LightwellLightComponent.h"
#include "host_sdk/c/check.h"

namespace {

/// Ticks until the component has shown a light, or half a minute.
bool shows(ULightwellLightComponent& component, const UDirectionalLightComponent& sun, float above) {
  for (int i = 0; i < 3000 && !(sun.Intensity > above); ++i) {
    component.TickComponent(0.01F, LEVELTICK_All, nullptr);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return sun.Intensity > above;
}

void light_of_a_recording_is_shown(const std::string& uri) {
  ULightwellLightComponent component;
  UDirectionalLightComponent sun;
  USkyLightComponent sky;
  component.Address = uri.c_str();
  component.Sun = &sun;
  component.Sky = &sky;
  component.Gain = 2;
  component.BeginPlay();
  CHECK(shows(component, sun, 0));
  // The recording has one or more lights of decreasing red, green, blue.
  CHECK(sun.Color.R == 1 && sun.Color.G < 1 && sun.Color.B < sun.Color.G && sun.Angle > 0);
  CHECK(sky.Intensity > 0 && sky.Color.R == 1 && sky.Color.B < 1);
  CHECK(component.GetColorTemperature() > 1000);
  CHECK(std::abs(sun.Rotation.Pitch) <= 90 && std::abs(sun.Rotation.Yaw) <= 180);
  // The recording ends, its light becomes old and fades away.
  for (int i = 0; i < 500 && sun.Intensity > 0; ++i) {
    component.TickComponent(0.01F, LEVELTICK_All, nullptr);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  CHECK(sun.Intensity == 0 && sky.Intensity == 0);
  component.EndPlay(EEndPlayReason::Quit);
  component.TickComponent(0.01F, LEVELTICK_All, nullptr);
}

void an_address_that_is_none_is_logged_once() {
  ULightwellLightComponent component;
  UDirectionalLightComponent sun;
  component.Address = "http://probe.local";
  component.Sun = &sun;
  component.BeginPlay();
  for (int i = 0; i < 50; ++i) {
    component.TickComponent(0.01F, LEVELTICK_All, nullptr);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  CHECK(sun.Intensity == -1);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  light_of_a_recording_is_shown("replay:" + std::string(argv[1]));
  an_address_that_is_none_is_logged_once();
  return checks_failed(7);
}
