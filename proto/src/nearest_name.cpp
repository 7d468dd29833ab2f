#include "nearest_name.hpp"

#include <algorithm>

#include <lightwell/text.hpp>

namespace lightwell {

std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names) {
  std::string nearest;
  std::size_t smallest = std::string::npos;
  for (const std::string& name : names) {
    // A name without the part before its last dot also matches.
    const std::size_t d = std::min(edit_distance(wrong, name), edit_distance(wrong, name.substr(name.rfind('.') + 1)));
    if (d < smallest) {
      smallest = d;
      nearest = name;
    }
  }
  if (nearest.empty()) return {};
  // A name that differs in more than half its length is hardly a typing error: list all names.
  if (smallest * 2 > std::max(wrong.size(), nearest.size()))
    return " (nearest known name: '" + nearest + "'; known: " + joined(names) + ")";
  return " (did you mean '" + nearest + "'?)";
}

}  // namespace lightwell
