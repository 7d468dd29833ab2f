#include "host_sdk/answers/estimate_answers.hpp"

#include <cmath>
#include <fstream>
#include <span>
#include <stdexcept>
#include <utility>

#include <lightwell/codec.hpp>
#include <lightwell/light_estimate.hpp>
#include <lightwell/text.hpp>

#include "host_sdk/answers/mutation.hpp"

namespace lightwell::test {
namespace {

template <std::size_t n>
void write(std::ostream& out, const std::array<float, n>& values) {
  for (const float v : values) out << formatted(" %.9g", double(v));
}

void write_estimate(std::ostream& out, const Lighting& light, const LightEstimateOptions& options) {
  const Converted<LightEstimate> estimate = estimate_light(light, options);
  const LightEstimate& e = estimate.value;
  out << "estimate " << static_cast<unsigned>(options.requested);
  write(out, std::array{options.gain, options.neutral_illuminance});
  out << ' ' << static_cast<int>(estimate.validity) << ' ' << static_cast<unsigned>(e.available);
  write(out, std::array{e.ambient_lumens, e.mean_illuminance, e.color_temperature, e.duv});
  write(out, e.ambient_color);
  write(out, e.ambient_spherical_harmonics);
  write(out, e.main_light_direction);
  write(out, e.main_light_color);
  write(out, std::array{e.main_light_lumens});
  out << '\n';
}

void write_temperatures(std::ostream& out) {
  constexpr int kSteps = 9;
  for (int i = -kSteps; i <= kSteps; ++i)
    for (int k = -kSteps; k <= kSteps; ++k) {
      const float r = std::exp2(static_cast<float>(i) / 3), b = std::exp2(static_cast<float>(k) / 3);
      const ColorTemperature t = color_temperature(r, 1, b).value_or(ColorTemperature{});
      out << formatted("temperature %.9g 1 %.9g %.17g %.17g\n", double(r), double(b), t.kelvin, t.duv);
    }
}

void write_weights(std::ostream& out) {
  for (const std::int64_t hold : {0, 250'000'000})
    for (const std::int64_t fade : {0, 500'000'000})
      for (std::int64_t age = 0; age <= 900'000'000; age += 50'000'000)
        out << "fade " << age << ' ' << hold << ' ' << fade
            << formatted(" %.9g\n", double(*fade_weight(Duration{age}, {Duration{hold}, Duration{fade}})));
}

}  // namespace

void write_estimate_answers(const std::filesystem::path& folder, const std::vector<std::string>& messages) {
  std::ofstream out(folder / "estimates.txt");
  for (const std::string& message : messages) {
    Result<Descriptor> descriptor = decode_descriptor(std::as_bytes(std::span(message)));
    if (!descriptor.ok()) throw std::runtime_error(descriptor.status().message());
    const Lighting light = Lighting::of(std::move(*descriptor));
    out << "message " << hex_of(message) << '\n';
    for (unsigned requested = 0; requested <= static_cast<unsigned>(LightRequest::all); ++requested)
      write_estimate(out, light, {.requested = static_cast<LightRequest>(requested)});
    write_estimate(out, light, {.gain = 2.5F, .neutral_illuminance = 400});
  }
  write_temperatures(out);
  write_weights(out);
  if (!out.flush()) throw std::runtime_error("cannot write estimates.txt");
}

}  // namespace lightwell::test
