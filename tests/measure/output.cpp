#include "measure/output.hpp"

#include <cmath>
#include <cstdint>
#include <iostream>

#include <nlohmann/json.hpp>

#include "tools/command_line.hpp"

namespace lightwell::measure {
namespace {

nlohmann::ordered_json json_of(double number) {
  if (number == std::trunc(number) && std::abs(number) < 1e15) return static_cast<std::int64_t>(number);
  return number;
}

}  // namespace

void print_line(const nlohmann::ordered_json& object) { std::cout << json_text(object) << std::endl; }

void print_figure(const std::string& figure, double value, std::initializer_list<std::pair<const char*, double>> more) {
  nlohmann::ordered_json object = {{"figure", figure}, {"value", json_of(value)}};
  for (const auto& [name, number] : more) object[name] = json_of(number);
  print_line(object);
}

}  // namespace lightwell::measure
