#include "tools/lightwell_eval/cases.hpp"

namespace lightwell::eval {

std::string_view to_string(SweepParameter parameter) {
  switch (parameter) {
    case SweepParameter::setting:
      return "setting";
    case SweepParameter::block:
      return "block";
    case SweepParameter::band:
      return "band";
    case SweepParameter::lights:
      return "lights";
    case SweepParameter::epsilon:
      return "epsilon";
    case SweepParameter::map:
      return "map";
    case SweepParameter::sensor:
      return "sensor";
  }
  return "unknown";
}

std::vector<Case> all_cases() {
  std::vector<Case> out;
  const auto add = [&](std::string label, SweepParameter parameter) -> Case& {
    Case& c = out.emplace_back();
    c.label = std::move(label);
    c.parameter = parameter;
    return c;
  };
  for (const int width : {640, 320, 1280}) {
    for (const Setting setting : kSettings) {
      Case& c = add(std::string(to_string(setting)) + (width == 640 ? "" : " @" + std::to_string(width)),
                    SweepParameter::setting);
      c.width = width;
      c.height = width * 3 / 4;
      c.config.setting = setting;
      c.named = true;
    }
  }
  // With epsilon 0, so that the descriptor is not reduced and the error is that of the block size.
  for (const int edge : {2, 4, 8, 16}) {
    Case& c = add("block " + std::to_string(edge) + ", eps 0", SweepParameter::block);
    c.block_edge = edge;
    c.config.panorama.epsilon = 0;
  }
  for (const int band : {0, 1, 2, 4}) add("band " + std::to_string(band), SweepParameter::band).config.band = band;
  for (const int lights : {0, 1, 4, 64})
    add("lights " + std::to_string(lights), SweepParameter::lights).config.max_lights = lights;
  for (const double percent : {0.2, 0.5, 2.0, 5.0}) {
    std::string text = std::to_string(percent);
    text.resize(3);
    add("eps " + text + " %", SweepParameter::epsilon).config.panorama.epsilon = percent / 100;
  }
  for (const int edge : {8, 16, 32, 64})
    add("map " + std::to_string(edge), SweepParameter::map).config.panorama.environment_edge = edge;
  for (const int exposures : {1, 3}) {
    for (const Setting setting : kSettings) {
      Case& c =
          add("8 bit x" + std::to_string(exposures) + " " + std::string(to_string(setting)), SweepParameter::sensor);
      c.sensor = Sensor::eight_bit;
      c.exposures = exposures;
      c.config.setting = setting;
      // A single exposure clips every lamp, which no setting changes (the descriptor is flagged).
      c.named = exposures > 1;
    }
  }
  return out;
}

}  // namespace lightwell::eval
