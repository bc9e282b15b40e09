"""Run `kr16` and turn whatever happens into one line on stderr and an exit code."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from kr16cli.errors import Kr16Error

_OUR_BUG = 70
_INTERRUPTED = 130
_TERMINATED = 143
_USAGE = 2


class _TerminatedError(SystemExit):
    """SIGTERM arrived: files that are half written go the way they go after an error.

    A SystemExit, so that a worker process that gets the signal ends in silence.
    """


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: arguments without the program's name; those of the process by default.

    Returns:
        The exit code: 0 done, 1 it ran and the answer is no, 2 usage or input or output,
        3 no physical answer, 4 an optional part is missing, 70 our bug, 130 interrupted,
        143 terminated.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    debug = bool(os.environ.get("KR16_DEBUG"))
    if "--debug" in arguments:
        arguments.remove("--debug")
        debug = True
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")  # a name may not fit the terminal
    try:
        with _termination():
            code = _run(arguments)
        if sys.stdout is not None:
            sys.stdout.flush()
    except BrokenPipeError:
        _drop_stdout()  # the reader has seen enough, as in `kr16 ... | head`
        return 0
    except KeyboardInterrupt:
        return _complain("interrupted; nothing more was written", _INTERRUPTED)
    except _TerminatedError:
        return _complain("terminated; nothing more was written", _TERMINATED)
    except Exception as error:
        if debug:
            raise
        if isinstance(error, OSError):
            _drop_stdout()
        return _complain(*_explained(error))
    return code


@contextmanager
def _termination() -> Iterator[None]:
    """Turns SIGTERM into an exception, unless the caller has a handler of its own."""
    # Signals can be handled in the main thread alone; elsewhere the caller deals with them.
    ours = signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    if ours:
        try:
            signal.signal(signal.SIGTERM, _terminate)
        except ValueError:
            ours = False
    try:
        yield
    finally:
        if ours:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _terminate(number: int, frame: object) -> None:
    raise _TerminatedError(_TERMINATED)


def _explained(error: Exception) -> tuple[str, int]:
    """The line and the exit code for an exception."""
    if isinstance(error, Kr16Error):
        return str(error), error.exit_code
    if isinstance(error, OSError):
        return f"{error.filename or 'standard output'}: {error.strerror or error}", _USAGE
    if hasattr(error, "format_message"):  # typer's own usage errors
        text, ctx = str(error.format_message()), getattr(error, "ctx", None)
        if text == "Missing command." and ctx is not None:
            text = (
                f"{ctx.command_path} needs a command: {', '.join(ctx.command.list_commands(ctx))}"
            )
        return text, _USAGE
    kind, text = type(error).__name__, " ".join(str(error).split())
    return f"this is our bug: {kind}: {text}; --debug shows where", _OUR_BUG


def _run(arguments: list[str]) -> int:
    """Find the command and run it; shell completion is left to typer."""
    import typer

    from kr16cli.cli.app import app

    command = typer.main.get_command(app)
    if "_KR16_COMPLETE" in os.environ:
        command.main(args=arguments, prog_name="kr16")
    try:
        with command.make_context("kr16", arguments) as context:
            code = command.invoke(context)
    except typer.Exit as stop:
        code = stop.exit_code
    except typer.Abort:
        raise KeyboardInterrupt from None
    return code if isinstance(code, int) else 0


def _complain(text: str, code: int) -> int:
    """One line on stderr."""
    if sys.stderr is not None:
        prefix = "kr16: " if code in (_INTERRUPTED, _TERMINATED) else "kr16: error: "
        print(prefix + " ".join(text.split()), file=sys.stderr)
    return code


def _drop_stdout() -> None:
    """Let the interpreter's last flush of stdout go nowhere, so that it cannot fail again."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (AttributeError, OSError, ValueError):
        sys.stdout = None
