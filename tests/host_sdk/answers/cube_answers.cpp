#include "host_sdk/answers/cube_answers.hpp"

#include <fstream>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

#include <lightwell/codec.hpp>
#include <lightwell/cube_map.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/text.hpp>

#include "host_sdk/answers/mutation.hpp"

namespace lightwell::test {

void write_cube_answers(const std::filesystem::path& folder, const std::vector<std::string>& messages) {
  std::ofstream out(folder / "cube_maps.txt");
  for (const std::string& message : messages) {
    Result<Descriptor> descriptor = decode_descriptor(std::as_bytes(std::span(message)));
    if (!descriptor.ok()) throw std::runtime_error(descriptor.status().message());
    const Lighting light = Lighting::of(std::move(*descriptor));
    out << "message " << hex_of(message) << '\n';
    for (const auto& [edge, lights, scale] :
         {std::tuple{5, LightsIncluded::yes, 1.0F}, {4, LightsIncluded::no, 0.5F}}) {
      const CubeMapOptions options{.edge = edge, .format = CubeFormat::rgba32f, .lights = lights, .scale = scale};
      std::vector<float> texels(cube_map_bytes(edge, options.format) / sizeof(float));
      const Answer<std::size_t> answer = cube_map(light, options, std::as_writable_bytes(std::span(texels)));
      out << "cube " << edge << (lights == LightsIncluded::yes ? " 1" : " 0") << formatted(" %.9g", double(scale))
          << ' ' << answer.value;
      for (std::size_t i = 0; i < texels.size(); ++i)
        if (i % 4 != 3) out << formatted(" %.9g", double(texels[i]));
      out << '\n';
    }
  }
  if (!out.flush()) throw std::runtime_error("cannot write cube_maps.txt");
}

}  // namespace lightwell::test
