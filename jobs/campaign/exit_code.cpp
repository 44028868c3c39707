#include "jobs/campaign/exit_code.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <iostream>
#include <new>
#include <system_error>

#include "archive/files/utf8.h"
#include "engine/library/library_use.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

ExitCode fail(ExitCode code, const std::string& message) {
  std::cerr << printable_message("graze: " + message) << std::endl;
  return code;
}

}  // namespace

ExitCode report_error(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const InputError& input) {
    return fail(kInvalidInput, input.what());
  } catch (const LibraryRefused& refused) {
    return fail(kInvalidInput, refused.what());
  } catch (const MachineError& machine) {
    return fail(kMachineFailed, machine.what());
  } catch (const std::bad_alloc&) {
    return fail(kMachineFailed, "out of memory");
  } catch (const std::filesystem::filesystem_error& file) {
    return fail(kMachineFailed, fmt::format("{}: {}", file.path1().string(), file.code().message()));
  } catch (const std::system_error& system) {
    if (system.code() == std::errc::resource_unavailable_try_again) {
      return fail(kMachineFailed, "the system lets no further thread be started (ulimit -u); end other programs");
    }
    return fail(kMachineFailed, fmt::format("internal error: {}", system.what()));
  } catch (const std::exception& other) {
    return fail(kMachineFailed, fmt::format("internal error: {}", other.what()));
  }
}

void warn(const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences) spdlog::warn("{}", sentence);
}

}  // namespace graze
