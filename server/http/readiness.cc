#include "server/http/readiness.h"

#include <mutex>
#include <utility>

namespace atlas {

// What the last write that was tried came to.
struct Readiness::Probe {
  void Set(const Result<bool>& result) {
    const std::lock_guard lock(mutex);
    status = result ? Status() : result.error();
  }
  Status Get() {
    const std::lock_guard lock(mutex);
    return status;
  }

  std::mutex mutex;
  Status status;
};

Readiness::Readiness(AtlasService& service, AtlasStore& store, const ReadinessOptions& options)
    : service_(service),
      store_(store),
      options_(options),
      probe_(std::make_shared<Probe>()),
      writer_({{"the store's writer",
                [&store, probe = probe_](const std::function<void()>& answer) {
                  store.Probe(AtlasStore::ProbeDepth::kDisk,
                              [probe, answer](const Result<bool>& result) {
                                probe->Set(result);
                                answer();
                              });
                }}},
              options.patience) {}

Status Readiness::Check() {
  if (service_.is_ending()) {
    return Status(StatusCode::kUnavailable, "draining");
  }
  const auto refusal = store_.ReadWriteFigures().last_refusal;
  if (refusal && Clock::now() - refusal->when < options_.refusal) {
    return refusal->why;
  }
  if (Status refusing = store_.ReadRoom().refusing; !refusing.ok()) {
    return refusing;
  }
  return CheckDisk();
}

Status Readiness::CheckDisk() {
  if (Clock::now() - disk_checked_at_ >= options_.fresh) {
    const Status answered = writer_.Check();
    disk_ = answered.ok() ? probe_->Get() : answered;
    disk_checked_at_ = Clock::now();
  }
  return disk_;
}

}  // namespace atlas
