#include "json_text.hpp"

#include <nlohmann/json.hpp>

namespace lightwell::tool {

std::string json_text(const nlohmann::ordered_json& document) {
  return document.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace lightwell::tool
