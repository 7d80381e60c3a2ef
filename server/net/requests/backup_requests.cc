#include "server/net/requests/backup_requests.h"

#include <chrono>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/this_coro.hpp>

#include "server/net/requests/answer.h"
#include "server/net/requests/atlas_wait.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/request_conversion.h"
#include "server/net/requests/wake_up.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetweenReplies{250};

// Between the thread that writes and the connection's.
class Writing {
 public:
  explicit Writing(const asio::any_io_executor& executor)
      : wake_up_(std::make_shared<WakeUp>(executor)) {}

  void Note(const BackupProgress& progress) {
    const std::lock_guard lock(mutex_);
    const bool is_next = progress.stage != progress_.stage;
    progress_ = progress;
    if (is_next || Clock::now() >= due_) {
      due_ = Clock::now() + kBetweenReplies;
      wake_up_->Ring();
    }
  }
  void End(Result<AtlasFacts> result) {
    const std::lock_guard lock(mutex_);
    result_ = std::move(result);
    wake_up_->Ring();
  }

  std::shared_ptr<WakeUp> wake_up() const { return wake_up_; }
  BackupProgress progress() const {
    const std::lock_guard lock(mutex_);
    return progress_;
  }
  std::optional<Result<AtlasFacts>> result() const {
    const std::lock_guard lock(mutex_);
    return result_;
  }

 private:
  const std::shared_ptr<WakeUp> wake_up_;
  mutable std::mutex mutex_;
  BackupProgress progress_;
  Clock::time_point due_ = Clock::time_point::min();
  std::optional<Result<AtlasFacts>> result_;
};

// Writes it when a thread is free for it; always ends `writing`.
asio::awaitable<void> Write(RequestContext& context,
                            BackupRequest request,
                            Patience patience,
                            const void* whose,
                            std::shared_ptr<Writing> writing) {
  const Blocking<AtlasFacts> write = [&context, request, patience, writing] {
    const auto note = [&writing](const BackupProgress& progress) {
      writing->Note(progress);
    };
    return context.service.Backup(request, patience, note);
  };
  try {
    Result<AtlasFacts> result = co_await context.reading_pool.Run(whose, patience.deadline, write);
    writing->End(std::move(result));
  } catch (const std::exception& error) {  // somebody waits for its end
    writing->End(Error(StatusCode::kInternal, error.what()));
  }
}

asio::awaitable<Status> AnswerList(RequestContext& context,
                                   const wire::Envelope& request,
                                   ReplyWriter& out) {
  const Blocking<std::vector<StoredBackup>> list = [&context] {
    return context.service.ListBackups();
  };
  const Result<std::vector<StoredBackup>> backups = co_await OnPool(context.pool, list);
  co_return co_await Answer(request, backups, &wire::Envelope::mutable_backup_reply, BackupsToWire,
                            out);
}

}  // namespace

asio::awaitable<Status> AnswerBackup(RequestContext& context,
                                     const Request& whole,
                                     ReplyWriter& out) {
  const wire::Envelope& request = *whole.message;
  const wire::BackupRequest& message = request.backup_request();
  if (message.name().empty()) {
    co_return co_await AnswerList(context, request, out);
  }
  const BackupRequest backup{message.name(), AuthorOf(out.peer().name, message.author())};
  if (Status status = CheckAuthor(backup.author); !status.ok()) {
    co_return status;
  }
  const Result<Places::Place> place = context.works.Take(out.peer());
  if (!place) {
    co_return place.error();
  }
  const Patience patience = PatienceOf(whole, message.timeout_ms(), out);
  const auto executor = co_await asio::this_coro::executor;
  const auto writing = std::make_shared<Writing>(executor);
  asio::co_spawn(executor, Write(context, backup, patience, out.peer().whose(), writing),
                 asio::detached);
  const std::shared_ptr<WakeUp> wake_up = writing->wake_up();
  std::optional<Result<AtlasFacts>> result;
  while (true) {
    co_await wake_up->Wait();
    result = writing->result();
    if (result) {
      break;
    }
    wire::Envelope reply = ReplyTo(request);
    ProgressToWire(writing->progress(), *reply.mutable_backup_reply());
    co_await out.Send(std::move(reply));  // whoever is gone ends it by having left
  }
  co_return co_await Answer(request, *result, &wire::Envelope::mutable_backup_reply, BackupToWire,
                            out);
}

}  // namespace atlas
