#include "app/temperature.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace lightwell {

std::optional<float> read_temperature(const std::string& folder) {
  // Beyond these a sensor is broken or not connected.
  constexpr long kMin_mC = -80'000, kMax_mC = 200'000;
  std::optional<float> hottest;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (!it->path().filename().string().starts_with("thermal_zone")) continue;
    long temperature_mC = 0;
    if (!(std::ifstream(it->path() / "temp") >> temperature_mC)) continue;
    if (temperature_mC < kMin_mC || temperature_mC > kMax_mC) continue;
    const float temperature = static_cast<float>(temperature_mC) * 1e-3F;
    hottest = std::max(hottest.value_or(temperature), temperature);
  }
  return hottest;
}

}  // namespace lightwell
