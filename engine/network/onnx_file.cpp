#include "engine/network/onnx_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "engine/network/wire.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

/// Far above any network that moves a robot.
constexpr std::size_t kMostNetworkNodes = 10000;
constexpr std::size_t kLongestName = 80;  // in messages
/// Inputs, and outputs: recurrent policies have two for each layer. Messages list them with their names.
constexpr std::size_t kMostPorts = 100, kLongestPortName = 256;

// TensorProto.DataType
constexpr int kFloat = 1, kInt32 = 6, kInt64 = 7, kDouble = 11;

std::string type_name(int data_type) {
  static constexpr std::array<const char*, 17> kNames = {
      "undefined", "float32", "uint8",   "int8",   "uint16", "int16",     "int32",      "int64",   "string",
      "bool",      "float16", "float64", "uint32", "uint64", "complex64", "complex128", "bfloat16"};
  const auto index = static_cast<std::size_t>(data_type);
  return index < kNames.size() ? kNames[index] : fmt::format("type {}", data_type);
}

/// A tensor as it is written, of which only one kind of numbers may be there.
struct WrittenTensor {
  std::string name;
  TensorShape shape;
  int data_type = 0;
  std::vector<double> singles, doubles;
  std::vector<std::int64_t> int32s, int64s;
  std::string_view raw;
  bool outside = false;
};

WrittenTensor read_written(std::string_view bytes) {
  WrittenTensor out;
  for (WireReader in(bytes, "TensorProto"); in.next();) {
    switch (in.field()) {
      case 1:
        in.integers(out.shape);
        break;
      case 2:
        out.data_type = static_cast<int>(in.integer());
        break;
      case 4:
        in.singles(out.singles);
        break;
      case 5:
        in.integers(out.int32s);
        break;
      case 7:
        in.integers(out.int64s);
        break;
      case 8:
        out.name = in.text();
        break;
      case 9:
        out.raw = in.bytes();
        break;
      case 10:
        in.doubles(out.doubles);
        break;
      case 13:
        out.outside = true;
        break;
      case 14:
        out.outside = out.outside || in.integer() == 1;
        break;
      default:
        break;
    }
  }
  return out;
}

std::vector<double> raw_numbers(const WrittenTensor& in) {
  const std::size_t width = in.data_type == kFloat || in.data_type == kInt32 ? 4 : 8;
  std::vector<double> out;
  for (std::size_t at = 0; at + width <= in.raw.size(); at += width) {
    out.push_back(in.data_type == kFloat    ? single_at(in.raw, at)
                  : in.data_type == kDouble ? double_at(in.raw, at)
                  : in.data_type == kInt32  ? static_cast<double>(int32_at(in.raw, at))
                                            : static_cast<double>(int64_at(in.raw, at)));
  }
  if (in.raw.size() % width != 0) out.clear();
  return out;
}

/// The numbers, of whichever field has them.
std::vector<double> written_numbers(const WrittenTensor& in) {
  if (!in.raw.empty()) return raw_numbers(in);
  const std::vector<std::int64_t>& whole = in.data_type == kInt64 ? in.int64s : in.int32s;
  if (in.data_type == kFloat) return in.singles;
  if (in.data_type == kDouble) return in.doubles;
  return {whole.begin(), whole.end()};
}

std::int64_t size_of_constant(const TensorShape& shape, const std::string& name) {
  try {
    return size_of(shape);
  } catch (const NetworkError& error) {
    throw NetworkError(name + " " + error.what());
  }
}

std::pair<std::string, Tensor> read_tensor(std::string_view bytes) {
  const WrittenTensor written = read_written(bytes);
  const std::string name = "the constant '" + clipped(written.name, kLongestName) + "'";
  if (written.outside) {
    throw NetworkError(name +
                       " is kept in another file (external data); save the network as one file, by "
                       "onnx.save_model(…, save_as_external_data=False)");
  }
  Tensor out{written.shape, element_type(written.data_type, name), {}};
  const auto size = static_cast<std::size_t>(size_of_constant(out.shape, name));
  const std::vector<double> numbers = written_numbers(written);
  if (numbers.size() != size) {
    throw NetworkError(fmt::format("{} of shape {} has {} numbers", name, text_of(out.shape), numbers.size()));
  }
  for (const double number : numbers) out.elements.push_back({-1, number});
  return {written.name, std::move(out)};
}

std::pair<std::string, OnnxAttribute> read_attribute(std::string_view bytes) {
  std::string name;
  OnnxAttribute out;
  for (WireReader in(bytes, "AttributeProto"); in.next();) {
    switch (in.field()) {
      case 1:
        name = in.text();
        break;
      case 2:
        out.number = in.single();
        break;
      case 3:
        out.integer = in.integer();
        break;
      case 4:
        out.text = in.text();
        break;
      case 5:
        out.tensors.push_back(read_tensor(in.bytes()).second);
        break;
      case 7:
        in.singles(out.numbers);
        break;
      case 8:
        in.integers(out.integers);
        break;
      case 9:
        out.texts.push_back(in.text());
        break;
      default:
        break;  // graphs: of operators that are refused
    }
  }
  return {name, std::move(out)};
}

OnnxNode read_node(std::string_view bytes) {
  OnnxNode out;
  for (WireReader in(bytes, "NodeProto"); in.next();) {
    switch (in.field()) {
      case 1:
        out.inputs.push_back(in.text());
        break;
      case 2:
        out.outputs.push_back(in.text());
        break;
      case 3:
        out.name = in.text();
        break;
      case 4:
        out.type = in.text();
        break;
      case 5:
        out.attributes.insert(read_attribute(in.bytes()));
        break;
      case 7:
        out.domain = in.text();
        break;
      default:
        break;
    }
  }
  return out;
}

std::int64_t read_dimension(std::string_view bytes) {
  std::int64_t out = 1;
  for (WireReader in(bytes, "Dimension"); in.next();) {
    if (in.field() == 1) out = in.integer() > 0 ? in.integer() : 1;
  }
  return out;
}

void read_port_type(std::string_view bytes, OnnxPort& out) {
  for (WireReader type(bytes, "TypeProto"); type.next();) {
    if (type.field() != 1) continue;
    for (WireReader tensor(type.bytes(), "TypeProto.Tensor"); tensor.next();) {
      if (tensor.field() == 1) out.element_type = static_cast<int>(tensor.integer());
      if (tensor.field() != 2) continue;
      for (WireReader shape(tensor.bytes(), "TensorShapeProto"); shape.next();) {
        if (shape.field() == 1) out.shape.push_back(read_dimension(shape.bytes()));
      }
    }
  }
}

OnnxPort read_port(std::string_view bytes) {
  OnnxPort out;
  for (WireReader in(bytes, "ValueInfoProto"); in.next();) {
    if (in.field() == 1) out.name = in.text();
    if (in.field() == 2) read_port_type(in.bytes(), out);
  }
  if (out.shape.size() > kMostRank) {
    throw NetworkError(fmt::format("'{}' has {} dimensions; at most {}", clipped(out.name, kLongestName),
                                   out.shape.size(), kMostRank));
  }
  return out;
}

void read_graph(std::string_view bytes, OnnxFile& out) {
  std::int64_t numbers = 0;
  for (WireReader in(bytes, "GraphProto"); in.next();) {
    switch (in.field()) {
      case 1:
        out.nodes.push_back(read_node(in.bytes()));
        for (const auto& [name, attribute] : out.nodes.back().attributes) {
          for (const Tensor& tensor : attribute.tensors) numbers += tensor.size();
        }
        break;
      case 5: {
        auto constant = read_tensor(in.bytes());
        numbers += constant.second.size();
        const auto [place, fresh] = out.constants.insert(std::move(constant));
        if (!fresh) throw NetworkError("has two constants '" + clipped(place->first, kLongestName) + "'");
        break;
      }
      case 11:
        out.inputs.push_back(read_port(in.bytes()));
        break;
      case 12:
        out.outputs.push_back(read_port(in.bytes()));
        break;
      case 15:
        throw NetworkError("has sparse constants; only dense ones are read");
      default:
        break;
    }
    if (out.nodes.size() > kMostNetworkNodes) {
      throw NetworkError(fmt::format("has more than {} nodes", kMostNetworkNodes));
    }
    if (numbers > kMostNumbers) throw NetworkError(fmt::format("has more than {} constant numbers", kMostNumbers));
  }
}

void read_version(std::string_view bytes, OnnxFile& out) {
  std::string domain;
  std::int64_t version = 1;
  for (WireReader in(bytes, "OperatorSetIdProto"); in.next();) {
    if (in.field() == 1) domain = in.text();
    if (in.field() == 2) version = in.integer();
  }
  if (domain.empty() || domain == "ai.onnx") out.version = version;
}

void check_ports(const std::vector<OnnxPort>& ports, const char* what) {
  if (ports.size() > kMostPorts) {
    throw NetworkError(fmt::format("has {} {}s; at most {}", ports.size(), what, kMostPorts));
  }
  for (const OnnxPort& port : ports) {
    if (port.name.size() <= kLongestPortName) continue;
    throw NetworkError(fmt::format("has the {} '{}' of {} bytes; names have at most {}", what,
                                   clipped(port.name, kLongestName), port.name.size(), kLongestPortName));
  }
}

}  // namespace

ElementType element_type(int data_type, const std::string& what) {
  switch (data_type) {
    case kFloat:
      return ElementType::single;
    case kDouble:
      return ElementType::real;
    case kInt32:
    case kInt64:
      return ElementType::integer;
    default:
      throw NetworkError(fmt::format("{} is of {}; numbers must be float32, float64 or, for shapes, whole", what,
                                     type_name(data_type)));
  }
}

OnnxFile read_onnx(std::string_view bytes) {
  OnnxFile out;
  bool graph = false;
  for (WireReader in(bytes, "ModelProto"); in.next();) {
    if (in.field() == 2) out.producer = in.text();
    if (in.field() == 8) read_version(in.bytes(), out);
    if (in.field() != 7) continue;
    if (std::exchange(graph, true)) throw NetworkError("is no ONNX file, or a damaged one: it has two graphs");
    read_graph(in.bytes(), out);
  }
  if (!graph) throw NetworkError("is no ONNX file, or a damaged one: it has no graph");
  std::erase_if(out.inputs, [&](const OnnxPort& port) { return out.constants.contains(port.name); });
  check_ports(out.inputs, "input");
  check_ports(out.outputs, "output");
  return out;
}

}  // namespace graze
