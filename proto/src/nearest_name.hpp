// Suggestions for misspelt names of fields.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lightwell {

/// Suffix of an error message about a name that is not one of `names`: " (did you mean 'nearest'?)".
[[nodiscard]] std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names);

}  // namespace lightwell
