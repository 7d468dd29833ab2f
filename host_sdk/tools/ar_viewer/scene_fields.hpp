// Strict reading of JSON objects: every field is known, of its type and within its range.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell::viewer {

struct Range {
  double least, most;
};
/// Of a length or a coordinate, m.
inline constexpr Range kAnyLength{-1e4, 1e4};
inline constexpr Range kUnitRange{0, 1};

/// A value of the file for a message, at most 40 characters of ASCII.
[[nodiscard]] std::string excerpt(const nlohmann::json& value);
/// A path that is relative to `folder`, unless it is absolute.
[[nodiscard]] std::string path_beside(const std::string& folder, const std::string& path);
/// What is wrong if there is no such file, and the remedy; otherwise empty.
[[nodiscard]] std::string missing_file(const std::string& path);

/// The fields of one object of a scene file. The first error is kept; then nothing is read any more.
class Fields {
 public:
  /// where: the path of the object in the file, such as "objects[2].material"; empty for the whole.
  Fields(const nlohmann::json& object, std::string where, Status& status);

  [[nodiscard]] bool has(const char* name) const;
  /// Each leaves `value` alone if the field is absent.
  void read(const char* name, double& value, Range range);
  void read(const char* name, float& value, Range range);
  void read(const char* name, int& value, Range range);
  void read(const char* name, std::string& value);
  void read(const char* name, Pose& value);
  /// The path of a file that must exist, relative to `folder`.
  void read_path(const char* name, const std::string& folder, std::string& value);
  /// A list of exactly so many numbers.
  void read(const char* name, std::span<double> values, Range range);
  void read(const char* name, std::span<float> values, Range range);
  /// One of `names`, which are those of the enumerators from 0 on.
  template <class Enum>
  void read_choice(const char* name, std::span<const std::string_view> names, Enum& value) {
    if (const std::optional<std::size_t> index = choice(name, names)) value = static_cast<Enum>(*index);
  }
  /// A member that the caller reads: null if absent.
  [[nodiscard]] const nlohmann::json* member(const char* name);
  void require(const char* name);

  /// Call it last: an error for a field that was never read, with the known ones.
  void refuse_others();
  /// An error in a field of this object: "field where.name: problem".
  void fail(const std::string& name, const std::string& problem);
  [[nodiscard]] std::string path_of(const std::string& name) const;
  [[nodiscard]] Status& status() { return status_; }

 private:
  [[nodiscard]] std::optional<std::size_t> choice(const char* name, std::span<const std::string_view> names);
  void read_numbers(const char* name, std::size_t count, Range range,
                    const std::function<void(std::size_t, double)>& take);

  const nlohmann::json& object_;
  std::string where_;
  Status& status_;
  std::set<std::string, std::less<>> known_;
};

}  // namespace lightwell::viewer
