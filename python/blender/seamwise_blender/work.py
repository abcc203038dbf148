"""Work in a thread of its own, while Blender shows how far it is and Escape ends it."""

import threading
import traceback

import bpy

from .engine import Canceled, Failed, Watch


class Job(threading.Thread):
    """A function of a watch, its result or its error."""

    def __init__(self, function):
        super().__init__(daemon=True)
        self.function, self.watch = function, Watch()
        self.result = self.error = None

    def run(self):
        try:
            self.result = self.function(self.watch)
        except Exception as error:
            self.error = error


class Work:
    """An operator whose `prepare` reads the scene and returns a function for the thread, and whose
    `finish` takes that function's result and changes the scene. `clean` comes last, whatever happened."""

    def execute(self, context):
        try:
            self.job = Job(self.prepare(context))
        except Exception as error:
            return self._fail(error)
        if bpy.app.background:
            self.job.run()
            return self._end(context)
        self.job.start()
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self.timer = manager.event_timer_add(0.1, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        watch = self.job.watch
        if event.type == "ESC":
            watch.canceled = True
        if event.type != "TIMER":
            return {"RUNNING_MODAL"} if event.type == "ESC" else {"PASS_THROUGH"}
        if self.job.is_alive():
            share = 100 * watch.done // watch.total if watch.total else 0
            told = "ending" if watch.canceled else f"{watch.stage} {share} %" if watch.total else watch.stage
            context.workspace.status_text_set(f"{self.bl_label}: {told}    (Escape ends it)")
            context.window_manager.progress_update(share)
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)
        return self._end(context)

    def _end(self, context):
        try:
            if self.job.error is not None:
                return self._fail(self.job.error)
            self.finish(context, self.job.result)
        except Exception as error:
            return self._fail(error)
        finally:
            self.clean()
        return {"FINISHED"}

    def _fail(self, error):
        self.clean()
        if isinstance(error, Canceled):
            self.report({"WARNING"}, f"{self.bl_label}: ended, and nothing was changed")
            return {"CANCELLED"}
        if not isinstance(error, Failed):
            traceback.print_exception(error)
        self.report({"ERROR"}, f"{self.bl_label}: {error or type(error).__name__}")
        return {"CANCELLED"}
