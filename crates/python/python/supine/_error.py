"""What a session raises and warns of."""


class SupineError(Exception):
    """Why there is no result; the same as `supine --json` tells.

    Attributes:
        message: what is wrong, where, and what to do.
        code: a word that stays the same from version to version, such as ``"tumour-outside-ct"``.
        kind: ``"input"``, ``"usage"``, ``"method"``, ``"check"``, ``"output"``, ``"retry"`` or ``"stopped"``.
        exit: the exit code that the command line ends with: 1, 2, 3, 4, 5, 75 or 130.
        place: where it lies, as far as that is known: ``"file"``, ``"key"`` of the case, ``"stage"`` of the flow.
        advice: what to do, where the message says so; else ``None``.
    """

    def __init__(
        self,
        message: str,
        code: str,
        kind: str,
        exit: int,
        place: dict[str, str],
        advice: str | None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.code = code
        self.kind = kind
        self.exit = exit
        self.place = place
        self.advice = advice

    def __reduce__(self) -> tuple[type["SupineError"], tuple[object, ...]]:
        # Engines such as Dask send exceptions from process to process.
        arguments = (self.message, self.code, self.kind, self.exit, self.place, self.advice)
        return (type(self), arguments)


class SupineWarning(UserWarning):
    """What the user must know before trusting a result.

    Attributes:
        message: what it says.
        code: a word that stays the same from version to version.
        stage: the stage that says it.
    """

    def __init__(self, message: str, code: str, stage: str) -> None:
        super().__init__(message)
        self.message = message
        self.code = code
        self.stage = stage

    def __reduce__(self) -> tuple[type["SupineWarning"], tuple[str, str, str]]:
        return (type(self), (self.message, self.code, self.stage))
