#include "calibration/solve/import/yaml_map.hpp"

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
    : file_(std::move(file)), path_(std::move(path)), node_(std::move(node)) {
  std::set<std::string> seen;
  for (const auto& entry : node_)
    if (entry.first.IsScalar() && !seen.insert(entry.first.Scalar()).second)
      throw ImportError(at_line(file_, entry.first.Mark()) + ": " + path_ + entry.first.Scalar() +
                        " is there twice; leave one of them out");
}

YamlMap YamlMap::parse(std::string_view text, const std::string& name) {
  try {
    const YAML::Node node = YAML::Load(std::string(text));
    if (!node.IsMap()) throw ImportError(name + ": no YAML with fields; is it the right file?");
    return {name, "", node};
  } catch (const YAML::Exception& e) {
    throw ImportError(at_line(name, e.mark) + ": not YAML: " + e.msg);
  }
}

YAML::Node YamlMap::at(const std::string& key) const { return std::as_const(node_)[key]; }

YAML::Node YamlMap::required(const std::string& key) const {
  if (!has(key)) refuse(key, "is missing");
  return at(key);
}

bool YamlMap::has(const std::string& key) const { return at(key).IsDefined(); }

bool YamlMap::is_map(const std::string& key) const { return has(key) && at(key).IsMap(); }

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> out;
  for (const auto& entry : node_)
    if (entry.first.IsScalar()) out.push_back(entry.first.Scalar());
  return out;
}

std::string YamlMap::one_of(const std::vector<std::string>& spellings) const {
  std::string found;
  for (const std::string& s : spellings) {
    if (!has(s)) continue;
    if (!found.empty()) refuse(s, "has the same meaning as " + found + "; leave one of them out");
    found = s;
  }
  return found.empty() ? spellings.front() : found;
}

void YamlMap::refuse(const std::string& key, const std::string& what) const {
  const YAML::Mark mark = has(key) ? at(key).Mark() : node_.Mark();
  throw ImportError(at_line(file_, mark) + ": " + path_ + key + ": " + what);
}

YamlMap YamlMap::map(const std::string& key) const {
  const YAML::Node node = required(key);
  if (!node.IsMap()) refuse(key, "must have fields of its own");
  return {file_, path_ + key + ".", node};
}

std::string YamlMap::word(const std::string& key) const {
  const YAML::Node node = required(key);
  if (!node.IsScalar()) refuse(key, "must be one word");
  return node.Scalar();
}

double YamlMap::number(const std::string& key) const {
  const YAML::Node node = required(key);
  double value = 0;
  if (!node.IsScalar()) refuse(key, "must be one number");
  if (!YAML::convert<double>::decode(node, value)) refuse(key, "'" + node.Scalar() + "' is not a number");
  return value;
}

std::vector<double> YamlMap::numbers(const std::string& key) const {
  std::vector<double> values;
  if (!all_numbers(required(key), values)) refuse(key, "must be a list of numbers");
  return values;
}

std::vector<std::vector<double>> YamlMap::rows(const std::string& key) const {
  const YAML::Node node = required(key);
  if (!node.IsSequence()) refuse(key, "must be a list of rows");
  std::vector<std::vector<double>> out;
  for (const YAML::Node& row : node)
    if (!all_numbers(row, out.emplace_back())) refuse(key, "must be a list of rows of numbers");
  return out;
}

}  // namespace lightwell
