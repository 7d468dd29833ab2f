#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include <lightwell/text.hpp>

#include "imaging/uri.hpp"
#include "sim/panorama.hpp"

namespace lightwell::sim {

namespace {

constexpr std::array<std::string_view, 8> kScenes = {"city",  "courtyard", "forest",  "interior",
                                                     "night", "studio",    "sunrise", "sunset"};

/// Value of an environment variable; empty if unset.
std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// The folder of cmake/fetch_panoramas; empty if there is no home directory.
std::filesystem::path panorama_folder() {
  if (const std::string folder = environment("LIGHTWELL_PANORAMA_DIR"); !folder.empty()) return folder;
  std::filesystem::path cache = environment("LIGHTWELL_CACHE");
  if (cache.empty()) {
    std::filesystem::path base = environment("XDG_CACHE_HOME");
    if (base.empty() && !environment("HOME").empty()) base = std::filesystem::path(environment("HOME")) / ".cache";
    if (base.empty()) return {};
    cache = base / "lightwell";
  }
  return cache / "panoramas";
}

}  // namespace

Result<std::string> scene_path(std::string_view name_or_path) {
  if (name_or_path.ends_with(".exr") || name_or_path.ends_with(".hdr")) return std::string(name_or_path);

  const std::vector<std::string_view> known(kScenes.begin(), kScenes.end());
  const std::string name(name_or_path);
  if (std::find(known.begin(), known.end(), name_or_path) == known.end()) {
    const std::string near = nearest_name(name_or_path, known);
    return Status(StatusCode::invalid_argument,
                  "no scene is called '" + name + "'" + (near.empty() ? "" : ", did you mean '" + near + "'?") +
                      " Known: " + joined(kScenes) + ", or a path that ends in .exr or .hdr");
  }
  const std::filesystem::path file = panorama_folder() / (name + ".exr");
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    return Status(StatusCode::not_found,
                  "the panorama " + file.string() +
                      " is not there: run cmake/fetch_panoramas, or set LIGHTWELL_PANORAMA_DIR to the "
                      "folder that holds it");
  }
  return file.string();
}

}  // namespace lightwell::sim
