// A map in a YAML file, read field by field; error messages state file, line and field.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "calibration/solve/import/readers.hpp"

namespace lightwell {

class YamlMap : public Fields {
 public:
  /// Messages begin with `name`. Refuses invalid YAML, a document that is not a map, and duplicate keys.
  [[nodiscard]] static YamlMap parse(std::string_view text, const std::string& name) {
    try {
      const YAML::Node node = YAML::Load(std::string(text));
      if (!node.IsMap()) throw ImportError(name + ": no YAML with fields; is it the right file?");
      return {name, "", node};
    } catch (const YAML::Exception& e) {
      throw ImportError(at_line(name, e.mark) + ": not YAML: " + e.msg);
    }
  }

  [[nodiscard]] bool has(const std::string& key) const override { return at(key).IsDefined(); }
  [[nodiscard]] bool is_map(const std::string& key) const { return has(key) && at(key).IsMap(); }
  [[nodiscard]] std::vector<std::string> keys() const {
    std::vector<std::string> out;
    for (const auto& entry : node_)
      if (entry.first.IsScalar()) out.push_back(entry.first.Scalar());
    return out;
  }

  // Each refuses a key that is missing, or whose value is something else.
  [[nodiscard]] YamlMap map(const std::string& key) const {
    const YAML::Node node = required(key);
    if (!node.IsMap()) refuse(key, "must have fields of its own");
    return {file_, path_ + key + ".", node};
  }
  [[nodiscard]] std::string word(const std::string& key) const {
    const YAML::Node node = required(key);
    if (!node.IsScalar()) refuse(key, "must be one word");
    return node.Scalar();
  }
  [[nodiscard]] double number(const std::string& key) const {
    const YAML::Node node = required(key);
    double value = 0;
    if (!node.IsScalar()) refuse(key, "must be one number");
    if (!YAML::convert<double>::decode(node, value)) refuse(key, "'" + node.Scalar() + "' is not a number");
    return value;
  }
  [[nodiscard]] std::vector<double> numbers(const std::string& key) const {
    std::vector<double> values;
    if (!all_numbers(required(key), values)) refuse(key, "must be a list of numbers");
    return values;
  }
  /// A list of rows of numbers.
  [[nodiscard]] std::vector<std::vector<double>> rows(const std::string& key) const {
    const YAML::Node node = required(key);
    if (!node.IsSequence()) refuse(key, "must be a list of rows");
    std::vector<std::vector<double>> out;
    for (const YAML::Node& row : node)
      if (!all_numbers(row, out.emplace_back())) refuse(key, "must be a list of rows of numbers");
    return out;
  }

  /// The line is that of the key's value, or of this map if the key is missing.
  [[noreturn]] void refuse(const std::string& key, const std::string& what) const override {
    const YAML::Mark mark = has(key) ? at(key).Mark() : node_.Mark();
    throw ImportError(at_line(file_, mark) + ": " + path_ + key + ": " + what);
  }

 private:
  YamlMap(std::string file, std::string path, YAML::Node node)
      : file_(std::move(file)), path_(std::move(path)), node_(std::move(node)) {
    std::set<std::string> seen;
    for (const auto& entry : node_)
      if (entry.first.IsScalar() && !seen.insert(entry.first.Scalar()).second)
        throw ImportError(at_line(file_, entry.first.Mark()) + ": " + path_ + entry.first.Scalar() +
                          " is there twice; leave one of them out");
  }

  static std::string at_line(const std::string& file, const YAML::Mark& mark) {
    return mark.is_null() ? file : file + ":" + std::to_string(mark.line + 1);
  }

  /// Appends the numbers of a sequence to `out`; false if an element is not a number.
  static bool all_numbers(const YAML::Node& node, std::vector<double>& out) {
    if (!node.IsSequence()) return false;
    for (const YAML::Node& element : node) {
      double value = 0;
      if (!element.IsScalar() || !YAML::convert<double>::decode(element, value)) return false;
      out.push_back(value);
    }
    return true;
  }

  /// The node of a key, or undefined. Not a reference, because even a const YAML::Node shares mutable state.
  [[nodiscard]] YAML::Node at(const std::string& key) const { return std::as_const(node_)[key]; }
  [[nodiscard]] YAML::Node required(const std::string& key) const {
    if (!has(key)) refuse(key, "is missing");
    return at(key);
  }

  std::string file_, path_;
  YAML::Node node_;
};

}  // namespace lightwell
