"""Taking other people's objects into a catalogue folder.

`models.import_objects` is the command line; `models.objects.folder_catalogue` reads the result.
"""
