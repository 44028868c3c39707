#include "jobs/cli/live_page.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "engine/settings/settings.h"
#include "jobs/campaign/program_module.h"
#include "jobs/cli/page.h"

namespace graze {
namespace {

/// Pages that are opened as files may ask nobody; this one asks us.
std::string document(const std::string& data) {
  constexpr std::string_view kClosed = "default-src 'none'; ", kOpen = "default-src 'none'; connect-src 'self'; ";
  std::string out;
  for (const std::string_view text : page_template().head) out += text;
  const std::size_t policy = out.find(kClosed);
  if (policy != std::string::npos) out.replace(policy, kClosed.size(), kOpen);
  out += data;
  for (const std::string_view text : page_template().tail) out += text;
  return out;
}

std::unique_ptr<PageServer> load_page_server(const std::string& page) {
  const std::filesystem::path path = program_module(kPageServerModule);
  void* const module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  const auto make =
      module ? reinterpret_cast<decltype(&graze_make_page_server)>(dlsym(module, "graze_make_page_server")) : nullptr;
  if (!make) throw MachineError(fmt::format("--page: what serves pages cannot be loaded: {}", dlerror()));
  return std::unique_ptr<PageServer>(make(&page));
}

}  // namespace

LivePage::LivePage(const std::string& data, std::uint16_t port) {
  check_page_built("drive --page");
  server_ = load_page_server(document(data));
  address_ = server_->begin(port);
}

LivePage::~LivePage() = default;

void LivePage::show(std::string frame) { server_->show(std::move(frame)); }

std::vector<std::string> LivePage::pressed() { return server_->pressed(); }

}  // namespace graze
