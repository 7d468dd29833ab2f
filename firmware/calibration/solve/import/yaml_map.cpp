#include "calibration/solve/import/yaml_map.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace lightwell {

namespace {

std::string at_line(const std::string& file, const YAML::Mark& mark) {
  return mark.is_null() ? file : file + ":" + std::to_string(mark.line + 1);
}

/// Appends the numbers of a sequence to `out`; false if an element is not a number.
bool all_numbers(const YAML::Node& node, std::vector<double>& out) {
  if (!node.IsSequence()) return false;
  for (const YAML::Node& element : node) {
    double value = 0;
    if (!element.IsScalar() || !YAML::convert<double>::decode(element, value)) return false;
    out.push_back(value);
  }
  return true;
}

}  // namespace

YamlMap::YamlMap(std::string file, std::string path, YAML::Node node)
    : file_(std::move(file)), path_(std::move(path)), node_(std::move(node)) {}

Result<YamlMap> YamlMap::parse(std::string_view text, const std::string& name) {
  try {
    YamlMap map(name, "", YAML::Load(std::string(text)));
    if (!map.node_.IsMap())
      return Status(StatusCode::invalid_argument, name + ": no YAML with fields; is it the right file?");
    if (Status s = map.check_keys(); !s.ok()) return s;
    return map;
  } catch (const YAML::Exception& e) {
    return Status(StatusCode::invalid_argument, at_line(name, e.mark) + ": not YAML: " + e.msg);
  }
}

Status YamlMap::check_keys() const {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) continue;
    if (!seen.insert(entry.first.Scalar()).second)
      return {StatusCode::invalid_argument, at_line(file_, entry.first.Mark()) + ": " + path_ + entry.first.Scalar() +
                                                " is there twice; leave one of them out"};
  }
  return {};
}

YAML::Node YamlMap::at(const std::string& key) const { return std::as_const(node_)[key]; }

bool YamlMap::has(const std::string& key) const { return at(key).IsDefined(); }

bool YamlMap::is_map(const std::string& key) const { return has(key) && at(key).IsMap(); }

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> out;
  for (const auto& entry : node_)
    if (entry.first.IsScalar()) out.push_back(entry.first.Scalar());
  return out;
}

Result<std::string> YamlMap::one_of(const std::vector<std::string>& spellings) const {
  std::string found;
  for (const std::string& s : spellings) {
    if (!has(s)) continue;
    if (!found.empty()) return problem(s, "has the same meaning as " + found + "; leave one of them out");
    found = s;
  }
  return found;
}

Status YamlMap::problem(const std::string& key, const std::string& what) const {
  const YAML::Mark mark = has(key) ? at(key).Mark() : node_.Mark();
  return {StatusCode::invalid_argument, at_line(file_, mark) + ": " + path_ + key + ": " + what};
}

Result<YamlMap> YamlMap::map(const std::string& key) const {
  if (!has(key)) return problem(key, "is missing");
  if (!at(key).IsMap()) return problem(key, "must have fields of its own");
  YamlMap inner(file_, path_ + key + ".", at(key));
  if (Status s = inner.check_keys(); !s.ok()) return s;
  return inner;
}

Result<std::string> YamlMap::word(const std::string& key) const {
  if (!has(key)) return problem(key, "is missing");
  if (!at(key).IsScalar()) return problem(key, "must be one word");
  return at(key).Scalar();
}

Result<double> YamlMap::number(const std::string& key) const {
  if (!has(key)) return problem(key, "is missing");
  double value = 0;
  if (!at(key).IsScalar() || !YAML::convert<double>::decode(at(key), value))
    return problem(key, at(key).IsScalar() ? "'" + at(key).Scalar() + "' is not a number" : "must be one number");
  return value;
}

Result<std::vector<double>> YamlMap::numbers(const std::string& key) const {
  if (!has(key)) return problem(key, "is missing");
  std::vector<double> values;
  if (!all_numbers(at(key), values)) return problem(key, "must be a list of numbers");
  return values;
}

Result<std::vector<std::vector<double>>> YamlMap::rows(const std::string& key) const {
  if (!has(key)) return problem(key, "is missing");
  std::vector<std::vector<double>> out;
  const YAML::Node node = at(key);
  if (!node.IsSequence()) return problem(key, "must be a list of rows");
  for (const YAML::Node& row : node)
    if (!all_numbers(row, out.emplace_back())) return problem(key, "must be a list of rows of numbers");
  return out;
}

}  // namespace lightwell
