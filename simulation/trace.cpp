#include "simulation/trace.h"

namespace graze {

std::string_view outcome_name(Outcome outcome) {
  switch (outcome) {
    case Outcome::success:
      return "success";
    case Outcome::known_failure:
      return "known failure";
    case Outcome::unknown_failure:
      return "unknown failure";
    case Outcome::invalid:
      return "invalid";
  }
  return "invalid";
}

void FrameLog::reserve(std::size_t frames, std::size_t nq, std::size_t nv, std::size_t na) {
  time_.reserve(frames);
  q_.reserve(frames * nq);
  v_.reserve(frames * nv);
  tau_.reserve(frames * na);
}

void FrameLog::clear() {
  for (std::vector<double>* column : {&time_, &q_, &v_, &tau_}) column->clear();
}

void FrameLog::set(std::size_t i, double time, std::span<const double> q, std::span<const double> v,
                   std::span<const double> tau) {
  const auto put = [&](std::vector<double>& column, std::span<const double> row) {
    std::copy(row.begin(), row.end(), column.begin() + static_cast<std::ptrdiff_t>(i * row.size()));
  };
  time_[i] = time;
  put(q_, q);
  put(v_, v);
  put(tau_, tau);
}

void FrameLog::add(double time, std::span<const double> q, std::span<const double> v, std::span<const double> tau) {
  time_.push_back(time);
  q_.insert(q_.end(), q.begin(), q.end());
  v_.insert(v_.end(), v.begin(), v.end());
  tau_.insert(tau_.end(), tau.begin(), tau.end());
}

TelemetryFrame FrameLog::operator[](std::size_t i) const {
  const auto row = [&](const std::vector<double>& column) {
    const std::size_t width = column.size() / size();
    const auto first = column.begin() + static_cast<std::ptrdiff_t>(i * width);
    return std::vector<double>(first, first + static_cast<std::ptrdiff_t>(width));
  };
  return {time_[i], row(q_), row(v_), row(tau_)};
}

}  // namespace graze
