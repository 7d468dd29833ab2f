#include "tools/lightwell_calibrate/world_tags.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <sstream>

#include <lightwell/text.hpp>

#include "imaging/uri.hpp"

namespace lightwell::calibrate {

namespace {

const std::vector<std::string_view> kColumns = {"family", "id", "size_m", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};

using Row = std::map<std::string_view, std::string>;  // By column.

Result<WorldTag> tag_of(const Row& row) {
  WorldTag tag;
  if (const auto family = row.find("family"); family != row.end())
    if (const Status s = parse_tag_family(family->second).assign_to(tag.family); !s.ok()) return s;
  tag.id = parse_number<int>(row.at("id")).value_or(-1);
  if (tag.id < 0) return invalid_argument("id: '" + row.at("id") + "' is not a tag's number");
  Vec3d& t = tag.world_tag.translation;
  Quat& q = tag.world_tag.rotation;
  double* const numbers[] = {&tag.size_m, &t.x, &t.y, &t.z, &q.x, &q.y, &q.z, &q.w};
  for (std::size_t i = 0; i < std::size(numbers); ++i) {
    const std::string& text = row.at(kColumns[i + 2]);
    const auto value = parse_number<double>(text);
    if (!value) return invalid_argument(std::string(kColumns[i + 2]) + ": '" + text + "' is not a number");
    *numbers[i] = *value;
  }
  if (tag.id >= shape_of(tag.family).tags)
    return invalid_argument(std::string(to_string(tag.family)) + " has no tag " + std::to_string(tag.id));
  if (!(tag.size_m > 0)) return invalid_argument("size_m must be positive, in metres");
  const double norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  if (!(std::abs(norm - 1) < 1e-3))
    return invalid_argument("the quaternion's length is " + std::to_string(norm) + ", not 1");
  q = q.normalized();
  return tag;
}

}  // namespace

Result<std::vector<WorldTag>> parse_world_tags(std::string_view text, const std::string& name) {
  std::vector<WorldTag> out;
  std::vector<std::string_view> columns;
  std::istringstream lines{std::string(text)};
  int line_number = 0;
  const auto wrong = [&](const std::string& what) {
    return invalid_argument(name + ":" + std::to_string(line_number) + ": " + what);
  };
  for (std::string line; std::getline(lines, line);) {
    ++line_number;
    const std::vector<std::string_view> cells = comma_separated(line);
    if ((cells.size() == 1 && cells[0].empty()) || cells[0].starts_with('#')) continue;
    if (columns.empty()) {
      for (const std::string_view cell : cells) {
        const auto column = std::ranges::find(kColumns, cell);
        if (column == kColumns.end()) {
          const std::string near = nearest_name(cell, kColumns);
          return wrong("unknown column '" + std::string(cell) + "'" +
                       (near.empty() ? "" : "; did you mean '" + near + "'?"));
        }
        if (std::ranges::find(columns, cell) != columns.end())
          return wrong("column " + std::string(cell) + " is listed twice");
        columns.push_back(*column);
      }
      for (const std::string_view column : std::span(kColumns).subspan(1))  // family is optional.
        if (std::ranges::find(columns, column) == columns.end())
          return wrong("column " + std::string(column) + " is missing");
      continue;
    }
    if (cells.size() != columns.size())
      return wrong(formatted("%zu cells, where the first line names %zu", cells.size(), columns.size()));
    Row row;
    for (std::size_t i = 0; i < cells.size(); ++i) row.emplace(columns[i], cells[i]);
    const Result<WorldTag> tag = tag_of(row);
    if (!tag) return wrong(tag.status().message());
    for (const WorldTag& other : out)
      if (other.family == tag->family && other.id == tag->id)
        return wrong(std::string(to_string(tag->family)) + " " + std::to_string(tag->id) + " is listed twice");
    out.push_back(*tag);
  }
  if (out.empty()) return invalid_argument(name + ": lists no tag");
  return out;
}

}  // namespace lightwell::calibrate
