// The module `graze._block` for Python: a SteppedBlock, which jobs/python/graze/block.py gives its documented face.
// Arrays are copies.

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

#include "engine/library/library_use.h"
#include "engine/settings/inputs.h"
#include "jobs/python_module/stepped_block.h"
#include "scenarios/shipped_names.h"

namespace py = pybind11;

namespace graze {
namespace {

/// Contacts of all traces. A row is a point of a pair, in the order of the pair's points within each trace.
py::dict contact_arrays(const SteppedBlock& block) {
  std::map<std::tuple<int, int, int>, std::vector<const Contact*>> rows;  // by pair and point: [column]
  const auto columns = static_cast<std::size_t>(block.size());
  for (std::size_t column = 0; column < columns; ++column) {
    std::map<std::pair<int, int>, int> seen;
    for (const Contact& one : block.contacts[column]) {
      auto& row = rows[{one.a, one.b, seen[{one.a, one.b}]++}];
      row.resize(columns);
      row[column] = &one;
    }
  }
  const auto count = static_cast<py::ssize_t>(rows.size()), n = static_cast<py::ssize_t>(columns);
  py::array_t<int> pair({count, py::ssize_t{2}}), mode({count, n});
  py::array_t<bool> touching({count, n});
  py::array_t<double> gap({count, n}), point({count, py::ssize_t{3}, n}), normal({count, py::ssize_t{3}, n}),
      impulse({count, py::ssize_t{3}, n});
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  py::ssize_t i = 0;
  for (const auto& [key, row] : rows) {
    pair.mutable_at(i, 0) = std::get<0>(key);
    pair.mutable_at(i, 1) = std::get<1>(key);
    for (py::ssize_t k = 0; k < n; ++k) {
      const Contact* const one = row[static_cast<std::size_t>(k)];
      touching.mutable_at(i, k) = one && one->touching();
      mode.mutable_at(i, k) = one && one->touching() ? static_cast<int>(one->mode) : -1;
      gap.mutable_at(i, k) = one ? one->phi : kNone;
      for (py::ssize_t axis = 0; axis < 3; ++axis) {
        point.mutable_at(i, axis, k) = one ? one->p_W[axis] : kNone;
        normal.mutable_at(i, axis, k) = one ? one->n_W[axis] : kNone;
        impulse.mutable_at(i, axis, k) = one ? one->impulse_W[axis] : kNone;
      }
    }
    ++i;
  }
  using namespace py::literals;
  return py::dict("pair"_a = pair, "touching"_a = touching, "mode"_a = mode, "gap"_a = gap, "point"_a = point,
                  "normal"_a = normal, "impulse"_a = impulse);
}

/// (time, kind, a, b, feature_a, feature_b, impulse, x, y, z) of each, parts by their names.
py::list event_rows(const SteppedBlock& block, int column) {
  const TraceNames& names = block.names();
  py::list out;
  for (const Event& one : block.events(column)) {
    const bool limit = one.kind == EventKind::limit_begin || one.kind == EventKind::limit_end;
    const auto a = static_cast<std::size_t>(one.a);
    const std::string first = limit ? names.bodies.at(a) : names.colliders.at(a);
    const std::string second =
        limit ? (one.b > 0 ? "upper" : "lower") : names.colliders.at(static_cast<std::size_t>(one.b));
    out.append(py::make_tuple(one.time, std::string(event_kind_name(one.kind)), first, second,
                              std::string(feature_name(one.feature_a)), std::string(feature_name(one.feature_b)),
                              one.impulse, one.p_W.x(), one.p_W.y(), one.p_W.z()));
  }
  return out;
}

py::dict record_dict(const SteppedBlock& block, int column) {
  const TraceRecord& one = block.record(column);
  const std::vector<Requirement>& requirements = block.scenario().task.requirements;
  py::dict margins, violations;
  for (std::size_t i = 0; i < one.margins.size(); ++i) {
    margins[py::str(requirements[i].name)] = one.margins[i];
    violations[py::str(requirements[i].name)] = one.first_violations[i];
  }
  std::string outcome(outcome_name(one.outcome));
  std::replace(outcome.begin(), outcome.end(), ' ', '_');  // as archives have it
  py::object violated = py::none();
  if (one.violated >= 0) violated = py::str(requirements[static_cast<std::size_t>(one.violated)].name);
  using namespace py::literals;
  return py::dict("particle"_a = one.particle, "outcome"_a = outcome, "violated"_a = violated,
                  "end_time"_a = one.end_time, "objective_margin"_a = one.objective_margin, "digest"_a = one.digest,
                  "sequence"_a = one.sequence, "invalid_reason"_a = one.invalid_reason, "stopped"_a = one.stopped,
                  "margins"_a = margins, "first_violations"_a = violations);
}

py::list column_list(const std::vector<NamedColumn>& columns) {
  py::list out;
  for (const NamedColumn& one : columns) out.append(py::make_tuple(one.name, one.unit));
  return out;
}

/// What does not change while the block runs.
py::dict facts(const SteppedBlock& block) {
  const StateColumns columns = block.columns();
  const Scenario& scenario = block.scenario();
  std::vector<std::uint32_t> ids;
  for (const Particle& one : block.particles()) ids.push_back(one.id);
  using namespace py::literals;
  return py::dict("scenario"_a = scenario.name, "policy"_a = block.policy().name, "particles"_a = ids,
                  "seed"_a = scenario.seed, "step"_a = scenario.timing.step, "control"_a = scenario.timing.control,
                  "end"_a = scenario.timing.end, "warnings"_a = scenario.warnings, "links"_a = block.names().links,
                  "colliders"_a = block.names().colliders, "q"_a = column_list(columns.q),
                  "v"_a = column_list(columns.v), "tau"_a = column_list(columns.tau),
                  "requirements"_a = column_list(columns.requirements), "objective"_a = column_list(columns.objective));
}

/// Steps until the traces that go on have come to `until` s. False: none goes on. Python may interrupt it.
bool run_until(SteppedBlock& block, double until) {
  constexpr int kBetweenLooks = 100;  // steps
  const double half = block.scenario().timing.step / 2;
  for (int k = 1; std::find(block.active.begin(), block.active.end(), true) != block.active.end(); ++k) {
    if (*std::max_element(block.time.begin(), block.time.end()) >= until - half) return true;
    block.step();
    if (k % kBetweenLooks != 0) continue;
    { const py::gil_scoped_release others; }  // other threads have their turn
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return false;
}

/// Raises graze.GrazeError with the exit code that the program would have.
void raise_graze_error(int code, const char* text) {
  const py::object type = py::module_::import("graze.errors").attr("GrazeError");
  PyErr_SetObject(type.ptr(), type(code, text).ptr());
}

void translate(std::exception_ptr thrown) {
  constexpr int kInput = 2, kMachine = 3;
  try {
    std::rethrow_exception(std::move(thrown));
  } catch (const py::builtin_exception&) {
    throw;  // pybind11's own
  } catch (const LibraryRefused& error) {
    raise_graze_error(kInput, error.what());
  } catch (const MachineError& error) {
    raise_graze_error(kMachine, error.what());
  } catch (const CallTimedOut& error) {
    raise_graze_error(kMachine, error.what());
  } catch (const std::runtime_error& error) {  // InputError, and what a controller from outside has done
    raise_graze_error(kInput, error.what());
  }
}

}  // namespace
}  // namespace graze

PYBIND11_MODULE(_block, module) {
  using namespace graze;
  // What names in `include` mean where no file of that name is, from now on; "": nothing.
  module.def("mean_shipped_names", [](const std::string& data) {
    mean_includes([data](const std::string& name) { return scenario_in(data, name); });
  });
  py::register_local_exception_translator(translate);
  py::class_<SteppedBlock>(module, "Block")
      .def(py::init([](const std::string& file, const std::vector<std::pair<std::string, std::string>>& overrides,
                       const std::string& policy, const std::vector<std::uint32_t>& particles, std::uint64_t count,
                       std::optional<std::uint64_t> seed, bool trust) {
        std::vector<Override> changes;
        for (const auto& [path, value] : overrides) changes.push_back({path, value});
        return std::make_unique<SteppedBlock>(BlockRequest{file, changes, policy, particles, count, seed, trust});
      }))
      .def("facts", &facts)
      .def("step", &SteppedBlock::step)
      .def("run_until", &run_until)
      .def("stop", &SteppedBlock::stop)
      .def("contacts", &contact_arrays)
      .def("events", &event_rows)
      .def("record", &record_dict)
      .def_property_readonly("time", [](const SteppedBlock& b) { return py::array(py::cast(b.time)); })
      .def_property_readonly("active", [](const SteppedBlock& b) { return py::array(py::cast(b.active)); })
      .def_property_readonly("q", [](const SteppedBlock& b) { return SteppedBlock::Array(b.q); })
      .def_property_readonly("v", [](const SteppedBlock& b) { return SteppedBlock::Array(b.v); })
      .def_property_readonly("a", [](const SteppedBlock& b) { return SteppedBlock::Array(b.a); })
      .def_property_readonly("tau", [](const SteppedBlock& b) { return SteppedBlock::Array(b.tau); })
      .def_property_readonly("link_position",
                             [](const SteppedBlock& b) { return SteppedBlock::Array(b.link_position); })
      .def_property_readonly("link_rotation",
                             [](const SteppedBlock& b) { return SteppedBlock::Array(b.link_rotation); })
      .def_property_readonly("requirements", [](const SteppedBlock& b) { return SteppedBlock::Array(b.requirements); })
      .def_property_readonly("objective", [](const SteppedBlock& b) { return SteppedBlock::Array(b.objective); });
}
