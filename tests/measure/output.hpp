// Output of the measuring programs: a JSON object per line on stdout, for tests/figures.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>

#include <nlohmann/json_fwd.hpp>

namespace lightwell::measure {

/// Prints an object.
void print_line(const nlohmann::ordered_json& object);

/// Prints {"figure":NAME,"value":VALUE} with further numbers. Whole numbers have no decimal point; NaN and infinity are
/// null.
void print_figure(const std::string& figure, double value,
                  std::initializer_list<std::pair<const char*, double>> more = {});

}  // namespace lightwell::measure
