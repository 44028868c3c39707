#include "engine/network/network.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "engine/network/operators.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

constexpr std::size_t kLongestNodeName = 80;              // in messages
constexpr std::int64_t kMostElements = 4 * kMostNumbers;  // of all tensors together: 256 MiB while a file is read
constexpr std::int64_t kOldestSet = 7, kNewestSet = 22;   // of ai.onnx, whose meaning operators.h has

std::string name_of(const OnnxNode& node) {
  std::string name = node.name;
  if (name.empty() && !node.outputs.empty()) name = node.outputs[0];
  return fmt::format("node '{}' ({})", clipped(name, kLongestNodeName), clipped(node.type, kLongestNodeName));
}

/// The nodes that outputs depend on.
std::vector<const OnnxNode*> needed_nodes(const OnnxFile& file) {
  std::set<std::string> wanted;
  for (const OnnxPort& port : file.outputs) wanted.insert(port.name);
  std::vector<const OnnxNode*> out;
  for (auto node = file.nodes.rbegin(); node != file.nodes.rend(); ++node) {
    if (std::none_of(node->outputs.begin(), node->outputs.end(),
                     [&](const std::string& name) { return !name.empty() && wanted.contains(name); })) {
      continue;
    }
    wanted.insert(node->inputs.begin(), node->inputs.end());
    out.push_back(&*node);
  }
  std::reverse(out.begin(), out.end());
  return out;
}

OperatorFunction function_of(const OnnxNode& node) {
  const OperatorTable& known = network_operators();
  const auto found = known.find(node.type);
  const bool ours = node.domain.empty() || node.domain == "ai.onnx";
  if (ours && found != known.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [name, function] : known) names.push_back(name);
  throw NetworkError(fmt::format("{} is of an operator that is not known{}; known are {}", name_of(node),
                                 ours ? "" : " (of " + clipped(node.domain, kLongestNodeName) + ")",
                                 fmt::join(names, ", ")));
}

/// The graph while its nodes become steps.
class Graph {
 public:
  Graph(const OnnxFile& file, ProgramBuilder& build) : build_(build), version_(file.version), values_(file.constants) {
    for (const auto& [name, tensor] : values_) elements_ += tensor.size();
  }

  void add_input(const OnnxPort& port) {
    const ElementType type =
        element_type(port.element_type, "the input '" + clipped(port.name, kLongestNodeName) + "'");
    if (type == ElementType::integer) {
      throw NetworkError("the input '" + clipped(port.name, kLongestNodeName) + "' is of whole numbers");
    }
    if (!values_.emplace(port.name, build_.input(port.shape, type)).second) {
      throw NetworkError("has two inputs '" + clipped(port.name, kLongestNodeName) + "'");
    }
  }

  void add(const OnnxNode& node) {
    const OperatorFunction function = function_of(node);
    try {
      std::vector<const Tensor*> operands;
      for (const std::string& name : node.inputs) {
        operands.push_back(name.empty() ? nullptr : &value(name));
        if (operands.back() != nullptr) build_.handle(span_of(operands.back()->shape));
      }
      OperatorCall call(build_, node, version_, std::move(operands));
      function(call);
      take(node, std::move(call.results));
    } catch (const NetworkError& error) {
      throw NetworkError(fmt::format("{} {}", name_of(node), error.what()));
    }
  }

  const Tensor& value(const std::string& name) const {
    const auto found = values_.find(name);
    if (found != values_.end()) return found->second;
    throw NetworkError(fmt::format("takes '{}', which nothing before it makes", clipped(name, kLongestNodeName)));
  }

 private:
  void take(const OnnxNode& node, std::vector<Tensor> results) {
    for (const Tensor& result : results) {
      build_.handle(span_of(result.shape));
      if (result.size() != size_of(result.shape)) {  // operators rely on it of their operands
        throw NetworkError(fmt::format("makes {} numbers of shape {}", result.size(), text_of(result.shape)));
      }
    }
    for (std::size_t i = 0; i < node.outputs.size(); ++i) {
      const std::string& name = node.outputs[i];
      if (name.empty()) continue;
      if (i >= results.size()) throw NetworkError(fmt::format("has an output {} that is not known", i + 1));
      elements_ += results[i].size();
      if (elements_ > kMostElements) throw NetworkError("makes tensors of more numbers than fit into memory");
      if (!values_.emplace(name, std::move(results[i])).second) {
        throw NetworkError(fmt::format("makes '{}', which is there already", clipped(name, kLongestNodeName)));
      }
    }
  }

  ProgramBuilder& build_;
  std::int64_t version_, elements_ = 0;
  std::map<std::string, Tensor> values_;
};

NetworkPort port_of(const std::string& name, const Tensor& tensor, ProgramBuilder& build) {
  NetworkPort out{name, tensor.shape, tensor.type == ElementType::single, {}};
  for (const Element& element : tensor.elements) out.rows.push_back(build.row(element));
  return out;
}

}  // namespace

Network::Network(std::string_view bytes, const NetworkKernel& kernel) : kernel_(&kernel) {
  const OnnxFile file = read_onnx(bytes);
  producer_ = file.producer;
  if (file.version < kOldestSet || file.version > kNewestSet) {
    throw NetworkError(fmt::format("is written for operator set {} of ONNX; known are {} to {}", file.version,
                                   kOldestSet, kNewestSet));
  }
  ProgramBuilder build(kernel);
  Graph graph(file, build);
  for (const OnnxPort& port : file.inputs) graph.add_input(port);
  for (const OnnxNode* node : needed_nodes(file)) graph.add(*node);
  for (const OnnxPort& port : file.inputs) inputs_.push_back(port_of(port.name, graph.value(port.name), build));
  std::set<std::string> names;
  for (const OnnxPort& port : file.outputs) {
    if (!names.insert(port.name).second) {
      throw NetworkError("has two outputs '" + clipped(port.name, kLongestNodeName) + "'");
    }
    try {
      outputs_.push_back(port_of(port.name, graph.value(port.name), build));
    } catch (const NetworkError& error) {
      throw NetworkError(fmt::format("as an output it {}", error.what()));
    }
  }
  if (outputs_.empty()) throw NetworkError("has no outputs");
  program_ = build.finish();
}

BlockArray Network::memory() const {
  BlockArray out(program_.rows);
  for (const auto& [row, value] : program_.constants) std::fill_n(out.row(row), kLanes, value);
  return out;
}

}  // namespace graze
