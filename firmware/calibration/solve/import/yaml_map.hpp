// A map in a YAML file, read field by field; error messages state file, line and field.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

#include <lightwell/result.hpp>

namespace lightwell {

class YamlMap {
 public:
  /// Messages begin with `name`. Refuses invalid YAML, a document that is not a map, and duplicate keys.
  [[nodiscard]] static Result<YamlMap> parse(std::string_view text, const std::string& name);

  [[nodiscard]] bool has(const std::string& key) const;
  [[nodiscard]] std::vector<std::string> keys() const;
  /// The spelling of a key that is present, or empty; an error if two are.
  [[nodiscard]] Result<std::string> one_of(const std::vector<std::string>& spellings) const;

  [[nodiscard]] Result<YamlMap> map(const std::string& key) const;
  [[nodiscard]] Result<std::string> word(const std::string& key) const;
  [[nodiscard]] Result<double> number(const std::string& key) const;
  /// A list of numbers.
  [[nodiscard]] Result<std::vector<double>> numbers(const std::string& key) const;
  /// A list of rows of numbers.
  [[nodiscard]] Result<std::vector<std::vector<double>>> rows(const std::string& key) const;
  [[nodiscard]] bool is_map(const std::string& key) const;

  /// "FILE:LINE: cam0.KEY: WHAT"; the line is that of the key's value, or of this map if the key is missing.
  [[nodiscard]] Status problem(const std::string& key, const std::string& what) const;

 private:
  YamlMap(std::string file, std::string path, YAML::Node node);
  /// The node of a key; undefined if the key is missing. Not a reference, because even a const YAML::Node shares
  /// mutable state.
  [[nodiscard]] YAML::Node at(const std::string& key) const;
  [[nodiscard]] Status check_keys() const;

  std::string file_, path_;
  YAML::Node node_;
};

}  // namespace lightwell
