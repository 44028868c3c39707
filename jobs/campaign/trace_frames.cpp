#include "jobs/campaign/trace_frames.h"

namespace graze {
namespace {

std::vector<Pose> poses_of(const StepView& step) {
  const BlockState& state = step.physics.state();
  std::vector<Pose> X_WB(step.model.bodies.size(), Pose::Identity());
  for (std::size_t k = 0; k < X_WB.size(); ++k) {
    X_WB[k].translation() = state.position(static_cast<int>(k), step.lane);
    X_WB[k].linear() = state.rotation(static_cast<int>(k), step.lane);
  }
  return X_WB;
}

}  // namespace

bool FrameWatch::see(const StepView& step) {
  TraceFrames& out = frames_[step.particle];
  Pairs& contacts = contacts_[step.particle];
  if (step.step == step.first) {  // a trace may be simulated again
    out = {};
    contacts.clear();
  }
  const bool with_bodies = bodies_.contains(step.particle);
  if (with_bodies && step.step > step.first) add_contacts(step, contacts);
  const bool goes_on = step.time < ends_.at(step.particle);
  if (step.step % every_ != 0 && !step.ends && goes_on) return true;
  out.time.push_back(step.time);
  add_rows(step, out);
  if (with_bodies) {
    add_poses(step.model, poses_of(step), out);
    take_contacts(contacts, out);
  }
  return goes_on;
}

void FrameWatch::add_rows(const StepView& step, TraceFrames& out) {
  std::size_t at = 0;
  for (const BlockArray* array :
       {&step.physics.state().q, &step.physics.state().v, &step.tau, &step.requirements, &step.objective}) {
    out.rows.resize(std::max(out.rows.size(), at + static_cast<std::size_t>(array->rows())));
    for (int i = 0; i < array->rows(); ++i) out.rows[at++].push_back((*array)(i, step.lane));
  }
}

void FrameWatch::add_poses(const Model& model, const std::vector<Pose>& X_WB, TraceFrames& out) {
  if (out.shapes.empty()) {
    for (const Collider& one : model.colliders) {
      out.shapes.push_back({one.shape.size, one.X_BG, one.shape.spectrum ? one.shape.grid : nullptr});
    }
  }
  out.poses.resize(7 * X_WB.size());
  for (std::size_t k = 0; k < X_WB.size(); ++k) {
    const Vec3 p = X_WB[k].translation();
    const Quat r(X_WB[k].linear());
    const double row[] = {p.x(), p.y(), p.z(), r.x(), r.y(), r.z(), r.w()};
    for (std::size_t i = 0; i < 7; ++i) out.poses[7 * k + i].push_back(row[i]);
  }
}

void FrameWatch::take_contacts(Pairs& contacts, TraceFrames& out) {
  for (auto& [pair, contact] : contacts) {
    if (contact.normal_impulse <= 0) continue;
    contact.p_W /= contact.normal_impulse;
    contact.n_W.normalize();
    contact.frame = static_cast<std::uint32_t>(out.time.size() - 1);
    out.contacts.push_back(contact);
  }
  contacts.clear();
}

void FrameWatch::add_contacts(const StepView& step, Pairs& out) {
  for (const ContactPoint& point : step.physics.contact_points()) {
    if (!point.lanes[step.lane] || !point.touching()[step.lane]) continue;
    const Contact contact = point.contact(step.lane);
    FrameContact& sum = out[{contact.a, contact.b}];
    const double impulse = contact.normal_impulse();
    sum.a = contact.a;
    sum.b = contact.b;
    sum.p_W += impulse * contact.p_W;
    sum.n_W += impulse * contact.n_W;
    sum.normal_impulse += impulse;
  }
}

}  // namespace graze
