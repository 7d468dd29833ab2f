#include "tools/lightwell_eval/scenes.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <sstream>

#include "sim/panorama.hpp"

namespace lightwell::eval {
namespace {

constexpr std::array kEight = {"city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset"};
constexpr std::string_view kMore = "pmndrs_";

/// The folder of the eight panoramas.
Result<std::filesystem::path> folder() {
  const Result<std::string> one = sim::scene_path(kEight.front());
  if (!one) return one.status();
  return std::filesystem::path(*one).parent_path();
}

}  // namespace

Result<std::vector<std::string>> scene_files(const std::string& choice) {
  std::vector<std::string> names, out;
  if (choice == "eight" || choice == "all") {
    names.assign(kEight.begin(), kEight.end());
  } else {
    std::stringstream list(choice);
    for (std::string name; std::getline(list, name, ',');)
      if (!name.empty()) names.push_back(name);
  }
  if (names.empty())
    return Status(StatusCode::invalid_argument, "--scenes is empty: give all, eight, or names like city,night");
  for (const std::string& name : names) {
    const bool more = name.starts_with(kMore) && !name.ends_with(".exr");
    Result<std::string> path = std::string();
    if (more) {
      const auto in = folder();
      if (!in) return in.status();
      path = (*in / (name + ".exr")).string();
      if (!std::filesystem::exists(*path))
        return Status(StatusCode::not_found,
                      *path + " does not exist: run cmake/fetch_panoramas --all, which lists the names");
    } else {
      path = sim::scene_path(name);
      if (!path) return path.status();
    }
    out.push_back(*path);
  }
  if (choice != "all") return out;
  const auto in = folder();
  if (!in) return in.status();
  std::vector<std::string> more;
  std::error_code error;
  for (const auto& file : std::filesystem::directory_iterator(*in, error))
    if (file.path().filename().string().starts_with(kMore) && file.path().extension() == ".exr")
      more.push_back(file.path().string());
  if (more.empty())
    return Status(StatusCode::not_found, "there are no " + std::string(kMore) + "*.exr in " + in->string() +
                                             ": run cmake/fetch_panoramas --all");
  std::sort(more.begin(), more.end());
  out.insert(out.end(), more.begin(), more.end());
  return out;
}

}  // namespace lightwell::eval
