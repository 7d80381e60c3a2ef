// Read-only connections, lent to one thread at a time. Opened when needed, up to a limit; a caller
// beyond it waits for one to come back.
#pragma once

#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/sqlite_error.h"

namespace atlas {

class ReaderPool {
 public:
  ReaderPool(DatabaseOptions options, std::size_t max_connections)
      : options_(std::move(options)), max_connections_(max_connections) {}

  // Runs `read(Connection&)`, which returns a Result<T>, in one snapshot.
  template <typename T, typename Reading>
  Result<T> Run(Reading&& read) {
    try {
      const Lease lease(*this);
      const Snapshot snapshot(lease.connection());
      return read(lease.connection());
    } catch (const std::exception& error) {
      return Error(StatusFromException(error));
    }
  }

  // Runs `read` with these arguments in one snapshot.
  template <typename T, typename... Parameters, typename... Arguments>
  Result<T> Read(Result<T> (*read)(Connection&, Parameters...), const Arguments&... arguments) {
    return Run<T>([&](Connection& connection) { return read(connection, arguments...); });
  }
  template <typename T, typename... Parameters, typename... Arguments>
  Result<T> Read(T (*read)(Connection&, Parameters...), const Arguments&... arguments) {
    return Run<T>(
        [&](Connection& connection) { return Result<T>(read(connection, arguments...)); });
  }
  template <typename... Parameters, typename... Arguments>
  Status Check(Status (*check)(Connection&, Parameters...), const Arguments&... arguments) {
    return ReadStatus([&](Connection& connection) { return check(connection, arguments...); });
  }
  // The same of whatever returns a Status.
  template <typename Reading>
  Status ReadStatus(Reading&& read) {
    const auto result = Run<bool>([&](Connection& connection) -> Result<bool> {
      Status status = read(connection);
      return status.ok() ? Result<bool>(true) : Error(std::move(status));
    });
    return result ? Status() : result.error();
  }

 private:
  class Lease {
   public:
    explicit Lease(ReaderPool& pool) : pool_(pool), connection_(pool.Take()) {}
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    ~Lease() { pool_.Return(std::move(connection_)); }

    Connection& connection() const { return *connection_; }

   private:
    ReaderPool& pool_;
    std::unique_ptr<Connection> connection_;
  };

  std::unique_ptr<Connection> Take();
  // One whose snapshot could not be ended is closed: it would keep the log, and serve nobody.
  void Return(std::unique_ptr<Connection> connection);

  DatabaseOptions options_;
  std::size_t max_connections_;
  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<std::unique_ptr<Connection>> idle_;
  std::size_t open_ = 0;
};

}  // namespace atlas
