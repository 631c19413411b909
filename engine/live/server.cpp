#include <ensonify/engine/live/server.h>

#include <stdexcept>

#include <ensonify/engine/live/page.h>

#ifdef ENSONIFY_HTTPLIB

#include <poll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <random>
#include <string_view>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/refine/triangle_mesh.h>

#include <httplib.h>  // last: it includes resolv.h, which defines a macro with a name of Eigen's

#endif

namespace ensonify::engine {

bool is_loopback(const std::string& address) {
  if (address == "localhost" || address == "::1") return true;
  // "127." must be followed by three numbers, because a name server may resolve another name.
  if (!address.starts_with("127.") || address.size() > 15) return false;
  int dots = 0, digits = 0;
  for (const char c : address) {
    if (c == '.') {
      if (digits == 0) return false;
      ++dots;
      digits = 0;
    } else if (c >= '0' && c <= '9' && digits < 3) {
      ++digits;
    } else {
      return false;
    }
  }
  return dots == 3 && digits > 0;
}

#ifdef ENSONIFY_HTTPLIB

namespace {

using namespace std::chrono_literals;

constexpr std::size_t max_request_bytes = 32 * 1024;  // request line and headers, without the body
constexpr std::size_t max_body_bytes = 16 * 1024;
constexpr auto longest_request = 5s;
constexpr auto longest_standstill = 10s;      // of a page that does not read
constexpr auto slice = 100ms;                 // time between two checks whether the server stops
constexpr int max_unsent_bytes = 512 * 1024;  // per page
constexpr int max_readers = 32;
constexpr std::size_t max_connections = 64;  // served at the same time; further ones wait
constexpr std::string_view token_mark = "%TOKEN%";

/// A socket that closes if the client sends too much or too slowly, or does not read.
class GuardedStream final : public httplib::Stream {
 public:
  GuardedStream(socket_t socket, const std::atomic<bool>& stopping)
      : socket_(socket), stopping_(stopping), begun_(Clock::now()) {}

  bool is_readable() const override { return wait(POLLIN, begun_ + longest_request); }
  bool is_writable() const override { return wait(POLLOUT, Clock::now() + longest_standstill); }

  ssize_t read(char* to, std::size_t size) override {
    if (at_ == ahead_.size()) {
      if (read_ > max_request_bytes + max_body_bytes) return refuse();
      ahead_.resize(4096);
      at_ = 0;
      const ssize_t count =
          is_readable() ? ::recv(socket_, ahead_.data(), ahead_.size(), 0) : ssize_t{-1};
      ahead_.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
      if (count <= 0) return count;
      read_ += ahead_.size();
    }
    const std::size_t count = std::min(size, ahead_.size() - at_);
    std::copy_n(ahead_.data() + at_, count, to);
    at_ += count;
    return static_cast<ssize_t>(count);
  }

  ssize_t write(const char* from, std::size_t size) override {
    if (!is_writable()) return -1;
    return ::send(socket_, from, size, MSG_NOSIGNAL | MSG_DONTWAIT);
  }

  void get_remote_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  void get_local_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  socket_t socket() const override { return socket_; }

 private:
  bool wait(short events, Clock::time_point until) const {
    pollfd poll_for{socket_, events, 0};
    while (!stopping_ && Clock::now() < until) {
      const int ready = ::poll(&poll_for, 1, int(std::chrono::milliseconds(slice).count()));
      if (ready > 0) return (poll_for.revents & events) != 0;
      if (ready < 0 && errno != EINTR) return false;
    }
    return false;
  }
  ssize_t refuse() {
    static constexpr std::string_view answer =
        "HTTP/1.1 431 Request Header Fields Too Large\r\nContent-Length: 0\r\nConnection: "
        "close\r\n\r\n";
    write(answer.data(), answer.size());
    return -1;
  }

  socket_t socket_;
  const std::atomic<bool>& stopping_;
  Clock::time_point begun_;
  std::string ahead_;
  std::size_t at_ = 0, read_ = 0;
};

/// Serves one request per connection, through a GuardedStream.
class GuardedServer final : public httplib::Server {
 public:
  explicit GuardedServer(const std::atomic<bool>& stopping) : stopping_(stopping) {}

 private:
  bool process_and_close_socket(socket_t socket) override {
    GuardedStream stream(socket, stopping_);
    bool closed = false;
    const bool done = answer(stream, closed);
    ::shutdown(socket, SHUT_WR);
    // If data from the client is unread at the close, the kernel may drop the answer. So read it.
    std::array<char, 4096> rest;
    const Clock::time_point until = Clock::now() + 200ms;
    pollfd poll_for{socket, POLLIN, 0};
    while (Clock::now() < until && ::poll(&poll_for, 1, 20) > 0 &&
           ::recv(socket, rest.data(), rest.size(), MSG_DONTWAIT) > 0) {
    }
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
    return done;
  }

  /// Later versions of the library also want the addresses of both ends.
  template <class AnyStream>
  bool answer(AnyStream& stream, bool& closed) {
    if constexpr (requires { this->process_request(stream, true, closed, nullptr); })
      return this->process_request(stream, true, closed, nullptr);
    else
      return this->process_request(stream, "", 0, "", 0, true, closed, nullptr);
  }

  const std::atomic<bool>& stopping_;
};

std::string random_token() {
  std::random_device device;
  std::string token;
  for (int i = 0; i < 8; ++i) token += fmt::format("{:08x}", device());
  return token;
}

/// Compares in constant time, so that the time does not reveal the token.
bool same(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char differs = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    differs = static_cast<unsigned char>(differs | (a[i] ^ b[i]));
  return differs == 0;
}

bool is_number(std::string_view text) {
  return !text.empty() && text.size() <= 15 &&
         std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

/// Whether a host is a numeric address. A name could be made to resolve to this machine.
bool is_numeric_host(std::string_view host) {
  return host.find_first_not_of("0123456789abcdefABCDEF.:[]") == std::string_view::npos &&
         host.find_first_of(".:") != std::string_view::npos &&
         (host.front() == '[' || host.find_first_not_of("0123456789.") == std::string_view::npos);
}

std::string_view served_at(const PageFile& file) {
  return file.path == "/page.html" ? "/" : file.path;
}

const char* type_of(std::string_view path) {
  if (path.ends_with(".js")) return "text/javascript; charset=utf-8";
  return path.ends_with(".css") ? "text/css; charset=utf-8" : "text/html; charset=utf-8";
}

}  // namespace

struct LiveServer::Inner {
  Inner(LiveSession& its_session, const ServerOptions& its_options)
      : session(its_session), options(its_options), server(stopping) {
    if (!options.remote && !is_loopback(options.bind))
      throw std::invalid_argument(
          fmt::format("--bind {}: other machines could reach this address, and only the page's "
                      "token keeps them out; use 127.0.0.1, or allow it with --remote",
                      options.bind));
    server.new_task_queue = [] { return new httplib::ThreadPool(max_connections); };
    server.set_payload_max_length(max_body_bytes);
    server.set_tcp_nodelay(true);
    server.set_socket_options([](socket_t socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
      // Accepted sockets inherit this limit. Lines that wait longer in the kernel are too old.
      ::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &max_unsent_bytes, sizeof max_unsent_bytes);
    });
    server.set_default_headers(
        {{"Content-Security-Policy",
          "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src "
          "'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
         {"X-Content-Type-Options", "nosniff"},
         {"X-Frame-Options", "DENY"},
         {"Referrer-Policy", "no-referrer"},
         {"Cross-Origin-Opener-Policy", "same-origin"},
         {"Cross-Origin-Resource-Policy", "same-origin"},
         {"Cache-Control", "no-store"}});
    server.set_pre_routing_handler(
        [this](const httplib::Request& request, httplib::Response& response) {
          const int refused = why_not(request);
          if (refused == 0) return httplib::Server::HandlerResponse::Unhandled;
          response.status = refused;
          if (!request.has_header("Range"))  // httplib would apply the range to the answer
            response.set_content(fmt::format("{}\n", refused), "text/plain");
          return httplib::Server::HandlerResponse::Handled;
        });
    for (const PageFile& file : page_files())
      server.Get(std::string(served_at(file)), [this, file](const auto&, auto& response) {
        std::string content(file.content);
        if (const std::size_t mark = content.find(token_mark); mark != content.npos)
          content.replace(mark, token_mark.size(), token);
        response.set_content(std::move(content), type_of(file.path));
      });
    server.Get("/lines",
               [this](const auto& request, auto& response) { send_lines(request, response); });
    server.Get("/truth",
               [this](const auto& request, auto& response) { report_truth(request, response); });
    server.Post("/change",
                [this](const auto& request, auto& response) { change(request, response); });
    if (options.port == 0)
      port = server.bind_to_any_port(options.bind);
    else
      port = server.bind_to_port(options.bind, options.port) ? options.port : -1;
    if (port < 0)
      throw std::runtime_error(
          fmt::format("{} port {}: cannot listen there, another program may use it; choose another "
                      "--port",
                      options.bind, options.port));
    listener = std::thread([this] { server.listen_after_bind(); });
    while (!server.is_running()) std::this_thread::sleep_for(1ms);
  }

  ~Inner() {
    stopping = true;
    server.stop();
    listener.join();
  }

  /// The status to refuse a request with, or 0.
  int why_not(const httplib::Request& request) const {
    // Many ranges would make an answer that is many times as large as the file.
    if (request.has_header("Range")) return 416;
    // The library would wait for a body of 2^64 - 1 bytes.
    if (request.has_header("Content-Length") &&
        !is_number(request.get_header_value("Content-Length")))
      return 400;
    if (request.get_header_value_count("Host") != 1 || !is_ours(request.get_header_value("Host")))
      return 400;
    if (const std::size_t origins = request.get_header_value_count("Origin");
        origins > 1 || (origins == 1 && request.get_header_value("Origin") !=
                                            "http://" + request.get_header_value("Host")))
      return 403;
    if (request.has_header("Sec-Fetch-Site")) {
      const std::string site = request.get_header_value("Sec-Fetch-Site");
      if (site != "same-origin" && site != "none") return 403;
    }
    const bool data = request.path == "/lines" || request.path == "/truth";
    const bool gets =
        data || std::ranges::find(page_files(), request.path, served_at) != page_files().end();
    if (!gets && request.path != "/change") return 404;
    if (request.method != (gets ? "GET" : "POST")) return 405;
    if (request.method == "POST" && request.get_header_value_count("Origin") != 1) return 403;
    if ((data || !gets) && (request.get_header_value_count("X-Ensonify-Token") != 1 ||
                            !same(request.get_header_value("X-Ensonify-Token"), token)))
      return 403;
    return 0;
  }

  bool is_ours(const std::string& host) const {
    const std::string its_port = fmt::format(":{}", port);
    if (!host.ends_with(its_port)) return false;
    const std::string name = host.substr(0, host.size() - its_port.size());
    if (name == "127.0.0.1" || name == "localhost" || name == "[::1]" || name == options.bind)
      return true;
    return options.remote && !name.empty() && is_numeric_host(name);
  }

  void send_lines(const httplib::Request& request, httplib::Response& response) {
    if (++readers > max_readers) {
      --readers;
      response.status = 503;
      response.set_content("too many pages are open; close one\n", "text/plain");
      return;
    }
    struct Page {
      std::atomic<int>& readers;
      LiveSession::Watch watch;
      LineReader reader;
      Page(Inner& inner, bool mesh)
          : readers(inner.readers),
            watch(inner.session, mesh),
            reader(inner.session.ring(), mesh) {}
      ~Page() { --readers; }
    };
    const auto page = std::make_shared<Page>(*this, request.get_param_value("mesh") == "1");
    const auto send = [this, page](std::size_t, httplib::DataSink& sink) {
      for (const Bytes& frame : page->reader.next(250ms))
        if (!sink.write(frame->data(), frame->size())) return false;
      if (!stopping && !session.ring().closed()) return sink.is_writable();
      sink.done();
      return true;
    };
    response.set_chunked_content_provider("application/octet-stream", send);
  }

  void report_truth(const httplib::Request& request, httplib::Response& response) {
    const std::string line = request.get_param_value("line"),
                      column = request.get_param_value("column");
    if (!is_number(line) || !is_number(column)) {
      response.status = 400;
      return;
    }
    try {
      response.set_content(session.truth(std::stoull(line), std::stoull(column)),
                           "application/json");
    } catch (const std::out_of_range& gone) {
      answer(response, 404, gone.what());
    }
  }

  void change(const httplib::Request& request, httplib::Response& response) {
    if (request.get_header_value("Content-Type") != "application/json") {
      response.status = 415;
      return;
    }
    try {
      session.change(request.body);
      response.set_content("{}", "application/json");
    } catch (const SceneError& error) {
      answer(response, 400, error.what());
    } catch (const refine::MeshError& error) {
      answer(response, 400, error.what());
    } catch (const std::invalid_argument& error) {
      answer(response, 400, error.what());
    }
  }

  static void answer(httplib::Response& response, int status, std::string_view what) {
    response.status = status;
    response.set_content(ascii_json_text(nlohmann::json{{"error", what}}), "application/json");
  }

  LiveSession& session;
  ServerOptions options;
  std::string token = random_token();
  std::atomic<bool> stopping = false;
  std::atomic<int> readers = 0;
  GuardedServer server;
  int port = -1;
  std::thread listener;
};

bool has_live_server() { return true; }

LiveServer::LiveServer(LiveSession& session, const ServerOptions& options)
    : inner_(std::make_unique<Inner>(session, options)) {}
LiveServer::~LiveServer() = default;
int LiveServer::port() const { return inner_->port; }
std::string LiveServer::address() const {
  const std::string& host = inner_->options.bind;
  return host.find(':') == std::string::npos ? fmt::format("http://{}:{}/", host, port())
                                             : fmt::format("http://[{}]:{}/", host, port());
}

#else

struct LiveServer::Inner {};

bool has_live_server() { return false; }

LiveServer::LiveServer(LiveSession&, const ServerOptions&) {
  throw std::runtime_error(
      "this build has no live view: install cpp-httplib (libcpp-httplib-dev) and build again");
}
LiveServer::~LiveServer() = default;
int LiveServer::port() const { return 0; }
std::string LiveServer::address() const { return {}; }

#endif

}  // namespace ensonify::engine
