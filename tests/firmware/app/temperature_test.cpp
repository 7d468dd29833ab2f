#include "app/temperature.hpp"

#include <filesystem>

#include <gtest/gtest.h>

#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

TEST(Temperature, IsThatOfTheHottestZone) {
  const TempDir folder;
  const auto zone = [&](const std::string& name, const std::string& text) {
    std::filesystem::create_directories(folder.path(name));
    (void)folder.write(name + "/temp", text);
  };
  EXPECT_FALSE(read_temperature(folder.path("none"))) << "no sensor";
  EXPECT_FALSE(read_temperature(folder.path("."))) << "no zone";
  zone("thermal_zone0", "-5000\n");
  EXPECT_FLOAT_EQ(*read_temperature(folder.path(".")), -5);
  zone("thermal_zone1", "61250\n");
  zone("thermal_zone2", "48000\n");
  zone("cooling_device0", "99000\n");
  EXPECT_FLOAT_EQ(*read_temperature(folder.path(".")), 61.25F);
}

TEST(Temperature, BrokenSensorsAreIgnored) {
  const TempDir folder;
  int number = 0;
  for (const char* text : {"", "warm\n", "-274000\n", "2147483647\n", "99999999999999999999\n"}) {
    const std::string name = "thermal_zone" + std::to_string(number++);
    std::filesystem::create_directories(folder.path(name));
    (void)folder.write(name + "/temp", text);
  }
  std::filesystem::create_directories(folder.path("thermal_zone9"));
  EXPECT_FALSE(read_temperature(folder.path(".")));
}

}  // namespace
}  // namespace lightwell::test
