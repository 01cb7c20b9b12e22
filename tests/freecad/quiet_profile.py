"""Run by ``freecadcmd``: write preferences under which FreeCAD starts without asking or showing anything."""

import FreeCAD

BASE = "User parameter:BaseApp/Preferences/"


def write():
    """Write them into the profile of this process."""
    general = FreeCAD.ParamGet(BASE + "General")
    general.SetString("AutoloadModule", "PartWorkbench")
    general.SetBool("ShowSplasher", False)
    start = FreeCAD.ParamGet(BASE + "Mod/Start")
    start.SetBool("ShowOnStartup", False)
    start.SetBool("FirstStart2024", False)
    document = FreeCAD.ParamGet(BASE + "Document")
    for name in ("RecoveryEnabled", "AutoSaveEnabled", "CreateBackupFiles"):
        document.SetBool(name, False)
    FreeCAD.ParamGet(BASE + "Addons").SetBool("AutoCheck", False)
    report = FreeCAD.ParamGet(BASE + "OutputWindow")
    for name in (
        "checkShowReportViewOnWarning",
        "checkShowReportViewOnError",
        "checkShowReportViewOnNormalMessage",
    ):
        report.SetBool(name, False)
    FreeCAD.ParamGet(BASE + "MainWindow").SetBool("PythonWordWrap", True)
    FreeCAD.saveParameter()


write()
