// A map in a YAML file, read field by field; error messages state file, line and field.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "calibration/solve/import/readers.hpp"

namespace lightwell {

class YamlMap : public Fields {
 public:
  /// Messages begin with `name`. Refuses invalid YAML, a document that is not a map, and duplicate keys.
  [[nodiscard]] static YamlMap parse(std::string_view text, const std::string& name);

  [[nodiscard]] bool has(const std::string& key) const;
  [[nodiscard]] std::vector<std::string> keys() const;
  /// The spelling of a key that is present, or else the first one; refuses two.
  [[nodiscard]] std::string one_of(const std::vector<std::string>& spellings) const;

  // Each refuses a key that is missing, or whose value is something else.
  [[nodiscard]] YamlMap map(const std::string& key) const;
  [[nodiscard]] std::string word(const std::string& key) const;
  [[nodiscard]] double number(const std::string& key) const;
  [[nodiscard]] std::vector<double> numbers(const std::string& key) const;
  /// A list of rows of numbers.
  [[nodiscard]] std::vector<std::vector<double>> rows(const std::string& key) const;
  [[nodiscard]] bool is_map(const std::string& key) const;

  /// The line is that of the key's value, or of this map if the key is missing.
  [[noreturn]] void refuse(const std::string& key, const std::string& what) const override;

 private:
  /// Refuses duplicate keys.
  YamlMap(std::string file, std::string path, YAML::Node node);
  /// The node of a key; undefined if the key is missing. Not a reference, because even a const YAML::Node shares
  /// mutable state.
  [[nodiscard]] YAML::Node at(const std::string& key) const;
  /// Refuses a missing key.
  [[nodiscard]] YAML::Node required(const std::string& key) const;

  std::string file_, path_;
  YAML::Node node_;
};

}  // namespace lightwell
