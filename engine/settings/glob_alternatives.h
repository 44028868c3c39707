#pragma once
// Names in the braces of a glob that are written one by one, and so are each meant.

#include <string>
#include <string_view>
#include <vector>

namespace graze {

/// Alternatives in a glob's braces that match none of `names`, each as the glob with it in its braces' place:
/// "{LF,RX}_*" of legs LF and RH gives "RX_*". None of a glob without braces. Throws InputError as matches().
std::vector<std::string> idle_alternatives(std::string_view pattern, const std::vector<std::string>& names);

/// What there is to say of the first of them, with the name that may have been meant; "": there is none. `what`: what
/// the names are of, "joint".
std::string idle_alternative_problem(std::string_view pattern, const std::vector<std::string>& names,
                                     std::string_view what);

}  // namespace graze
