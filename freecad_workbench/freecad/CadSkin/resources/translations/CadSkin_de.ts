<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
 <context>
  <name>CadSkin</name>
  <message>
   <source>0: chosen from the size of the part</source>
   <translation>0: aus der Größe des Teils gewählt</translation>
  </message>
  <message>
   <source>Another seed: another part</source>
   <translation>Anderer Startwert: anderes Teil</translation>
  </message>
  <message>
   <source>Automatic</source>
   <translation>Automatisch</translation>
  </message>
  <message>
   <source>Bands</source>
   <translation>Stufen</translation>
  </message>
  <message>
   <source>Blue-red</source>
   <translation>Blau-Rot</translation>
  </message>
  <message>
   <source>Bottom left</source>
   <translation>Unten links</translation>
  </message>
  <message>
   <source>Bottom right</source>
   <translation>Unten rechts</translation>
  </message>
  <message>
   <source>Cancel</source>
   <translation>Abbrechen</translation>
  </message>
  <message>
   <source>Check</source>
   <translation>Prüfen</translation>
  </message>
  <message>
   <source>Colours</source>
   <translation>Farben</translation>
  </message>
  <message>
   <source>Compute</source>
   <translation>Berechnen</translation>
  </message>
  <message>
   <source>Conform</source>
   <translation>Einhalten</translation>
  </message>
  <message>
   <source>Corr. length</source>
   <translation>Korr.-Länge</translation>
  </message>
  <message>
   <source>Correlation length of the deviations; </source>
   <translation>Korrelationslänge der Abweichungen; </translation>
  </message>
  <message>
   <source>Correlation length; 0: a fifth of the part</source>
   <translation>Korrelationslänge; 0: ein Fünftel des Teils</translation>
  </message>
  <message>
   <source>Datum</source>
   <translation>Bezug</translation>
  </message>
  <message>
   <source>Datums</source>
   <translation>Bezüge</translation>
  </message>
  <message>
   <source>Datums of the part:</source>
   <translation>Bezüge des Teils:</translation>
  </message>
  <message>
   <source>Deviation</source>
   <translation>Abweichung</translation>
  </message>
  <message>
   <source>Deviation map</source>
   <translation>Abweichungsbild</translation>
  </message>
  <message>
   <source>Deviations of these faces</source>
   <translation>Abweichungen dieser Flächen</translation>
  </message>
  <message>
   <source>Draw</source>
   <translation>Ziehen</translation>
  </message>
  <message>
   <source>Evaluate the tolerances as they are now; the parts stay as they are</source>
   <translation>Die Toleranzen von jetzt auswerten; die Teile bleiben, wie sie sind</translation>
  </message>
  <message>
   <source>Exaggeration</source>
   <translation>Überhöhung</translation>
  </message>
  <message>
   <source>Face</source>
   <translation>Fläche</translation>
  </message>
  <message>
   <source>Grey</source>
   <translation>Grau</translation>
  </message>
  <message>
   <source>Hidden</source>
   <translation>Verborgen</translation>
  </message>
  <message>
   <source>How the parts are held inside the tolerances</source>
   <translation>Wie die Teile in den Toleranzen gehalten werden</translation>
  </message>
  <message>
   <source>Instances</source>
   <translation>Teile</translation>
  </message>
  <message>
   <source>Legend</source>
   <translation>Legende</translation>
  </message>
  <message>
   <source>Letter</source>
   <translation>Buchstabe</translation>
  </message>
  <message>
   <source>Manual</source>
   <translation>Von Hand</translation>
  </message>
  <message>
   <source>Mesh size</source>
   <translation>Netzweite</translation>
  </message>
  <message>
   <source>Model</source>
   <translation>Modell</translation>
  </message>
  <message>
   <source>Nothing was installed.</source>
   <translation>Es wurde nichts installiert.</translation>
  </message>
  <message>
   <source>Palette</source>
   <translation>Palette</translation>
  </message>
  <message>
   <source>Parts</source>
   <translation>Teile</translation>
  </message>
  <message>
   <source>Pick faces</source>
   <translation>Flächen wählen</translation>
  </message>
  <message>
   <source>Please wait...</source>
   <translation>Bitte warten...</translation>
  </message>
  <message>
   <source>Profile of any surface [mm]</source>
   <translation>Flächenprofil [mm]</translation>
  </message>
  <message>
   <source>Python with cadskin</source>
   <translation>Python mit cadskin</translation>
  </message>
  <message>
   <source>Rainbow</source>
   <translation>Regenbogen</translation>
  </message>
  <message>
   <source>Range</source>
   <translation>Bereich</translation>
  </message>
  <message>
   <source>Remove</source>
   <translation>Entfernen</translation>
  </message>
  <message>
   <source>Result</source>
   <translation>Ergebnis</translation>
  </message>
  <message>
   <source>Seed</source>
   <translation>Startwert</translation>
  </message>
  <message>
   <source>Share</source>
   <translation>Anteil</translation>
  </message>
  <message>
   <source>Show deviations</source>
   <translation>Abweichungen zeigen</translation>
  </message>
  <message>
   <source>Skin model</source>
   <translation>Hautmodell</translation>
  </message>
  <message>
   <source>Standard deviation as a share of the value of the tolerance</source>
   <translation>Standardabweichung als Anteil des Toleranzwerts</translation>
  </message>
  <message>
   <source>Surface</source>
   <translation>Oberfläche</translation>
  </message>
  <message>
   <source>Symmetric</source>
   <translation>Symmetrisch</translation>
  </message>
  <message>
   <source>Take the selected rows out of the list</source>
   <translation>Die gewählten Zeilen aus der Liste nehmen</translation>
  </message>
  <message>
   <source>This makes a Python environment in {} and downloads cadskin and the packages that it needs, some hundred megabytes, from the package index. Go on?</source>
   <translation>Dies legt eine Python-Umgebung in {} an und lädt cadskin und die nötigen Pakete, einige hundert Megabyte, aus dem Paketverzeichnis. Fortfahren?</translation>
  </message>
  <message>
   <source>Tolerance</source>
   <translation>Toleranz</translation>
  </message>
  <message>
   <source>Top left</source>
   <translation>Oben links</translation>
  </message>
  <message>
   <source>Top right</source>
   <translation>Oben rechts</translation>
  </message>
  <message>
   <source>Type</source>
   <translation>Art</translation>
  </message>
  <message>
   <source>Value</source>
   <translation>Wert</translation>
  </message>
  <message>
   <source>Value / limit</source>
   <translation>Wert / Grenze</translation>
  </message>
  <message>
   <source>Viridis</source>
   <translation>Viridis</translation>
  </message>
  <message>
   <source>Which of the parts is shown</source>
   <translation>Welches der Teile gezeigt wird</translation>
  </message>
  <message>
   <source>While this is down, a click on a face adds it or takes it away</source>
   <translation>Solange dies gedrückt ist, nimmt ein Klick eine Fläche hinzu oder heraus</translation>
  </message>
  <message>
   <source>all tolerances are held</source>
   <translation>alle Toleranzen sind eingehalten</translation>
  </message>
  <message>
   <source>angularity</source>
   <translation>Neigung</translation>
  </message>
  <message>
   <source>another task is open; close it first</source>
   <translation>eine andere Aufgabe ist offen; erst schließen</translation>
  </message>
  <message>
   <source>as the part</source>
   <translation>wie das Teil</translation>
  </message>
  <message>
   <source>can be used</source>
   <translation>brauchbar</translation>
  </message>
  <message>
   <source>circular runout</source>
   <translation>Rundlauf</translation>
  </message>
  <message>
   <source>coaxiality</source>
   <translation>Koaxialität</translation>
  </message>
  <message>
   <source>concentricity</source>
   <translation>Konzentrizität</translation>
  </message>
  <message>
   <source>cylindricity</source>
   <translation>Zylindrizität</translation>
  </message>
  <message>
   <source>flatness</source>
   <translation>Ebenheit</translation>
  </message>
  <message>
   <source>from</source>
   <translation>von</translation>
  </message>
  <message>
   <source>gone</source>
   <translation>weg</translation>
  </message>
  <message>
   <source>limit</source>
   <translation>Grenze</translation>
  </message>
  <message>
   <source>line profile</source>
   <translation>Linienprofil</translation>
  </message>
  <message>
   <source>mean</source>
   <translation>Mittel</translation>
  </message>
  <message>
   <source>no datum yet</source>
   <translation>noch kein Bezug</translation>
  </message>
  <message>
   <source>no face is picked</source>
   <translation>keine Fläche gewählt</translation>
  </message>
  <message>
   <source>no tolerance to hold</source>
   <translation>keine Toleranz einzuhalten</translation>
  </message>
  <message>
   <source>no tolerance: the range is symmetric</source>
   <translation>keine Toleranz: der Bereich ist symmetrisch</translation>
  </message>
  <message>
   <source>not evaluated</source>
   <translation>nicht ausgewertet</translation>
  </message>
  <message>
   <source>parallelism</source>
   <translation>Parallelität</translation>
  </message>
  <message>
   <source>part</source>
   <translation>Teil</translation>
  </message>
  <message>
   <source>perpendicularity</source>
   <translation>Rechtwinkligkeit</translation>
  </message>
  <message>
   <source>pick it again</source>
   <translation>neu wählen</translation>
  </message>
  <message>
   <source>position</source>
   <translation>Position</translation>
  </message>
  <message>
   <source>process</source>
   <translation>Prozess</translation>
  </message>
  <message>
   <source>round zone (⌀)</source>
   <translation>runde Zone (⌀)</translation>
  </message>
  <message>
   <source>roundness</source>
   <translation>Rundheit</translation>
  </message>
  <message>
   <source>smooth</source>
   <translation>stufenlos</translation>
  </message>
  <message>
   <source>std. dev.</source>
   <translation>Std.-Abw.</translation>
  </message>
  <message>
   <source>straightness</source>
   <translation>Geradheit</translation>
  </message>
  <message>
   <source>surface profile</source>
   <translation>Flächenprofil</translation>
  </message>
  <message>
   <source>symmetry</source>
   <translation>Symmetrie</translation>
  </message>
  <message>
   <source>the range needs its lower end below its upper end</source>
   <translation>das untere Ende des Bereichs muss unter dem oberen liegen</translation>
  </message>
  <message>
   <source>the value is proved</source>
   <translation>der Wert ist bewiesen</translation>
  </message>
  <message>
   <source>to</source>
   <translation>bis</translation>
  </message>
  <message>
   <source>tolerances not evaluated</source>
   <translation>Toleranzen nicht ausgewertet</translation>
  </message>
  <message>
   <source>tolerances not held</source>
   <translation>Toleranzen nicht eingehalten</translation>
  </message>
  <message>
   <source>total runout</source>
   <translation>Gesamtlauf</translation>
  </message>
  <message>
   <source>within the limit</source>
   <translation>innerhalb der Grenze</translation>
  </message>
 </context>
 <context>
  <name>CadSkinPreferences</name>
  <message>
   <source> mm</source>
   <translation> mm</translation>
  </message>
  <message>
   <source>Browse...</source>
   <translation>Durchsuchen...</translation>
  </message>
  <message>
   <source>Choose the Python that has cadskin</source>
   <translation>Das Python wählen, das cadskin hat</translation>
  </message>
  <message>
   <source>Create environment...</source>
   <translation>Umgebung anlegen...</translation>
  </message>
  <message>
   <source>Empty: the first one that has cadskin</source>
   <translation>Leer: das erste, das cadskin hat</translation>
  </message>
  <message>
   <source>General</source>
   <translation>Allgemein</translation>
  </message>
  <message>
   <source>Instances</source>
   <translation>Teile</translation>
  </message>
  <message>
   <source>Keep the worker running between jobs (saves its start)</source>
   <translation>Den Rechenprozess zwischen Aufträgen laufen lassen (spart seinen Start)</translation>
  </message>
  <message>
   <source>Make a Python environment and install cadskin in it; this downloads packages, and asks before</source>
   <translation>Eine Python-Umgebung anlegen und cadskin darin installieren; lädt Pakete herunter und fragt vorher</translation>
  </message>
  <message>
   <source>New skin models</source>
   <translation>Neue Hautmodelle</translation>
  </message>
  <message>
   <source>Python with cadskin</source>
   <translation>Python mit cadskin</translation>
  </message>
  <message>
   <source>Run a job in it and show its versions</source>
   <translation>Einen Auftrag darin ausführen und die Versionen zeigen</translation>
  </message>
  <message>
   <source>Seed</source>
   <translation>Startwert</translation>
  </message>
  <message>
   <source>Size of the triangles</source>
   <translation>Größe der Dreiecke</translation>
  </message>
  <message>
   <source>Test</source>
   <translation>Testen</translation>
  </message>
  <message>
   <source>Worker</source>
   <translation>Rechenprozess</translation>
  </message>
  <message>
   <source>a hundredth of the diagonal</source>
   <translation>ein Hundertstel der Diagonale</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_AcceptFaces</name>
  <message>
   <source>Accept changed faces</source>
   <translation>Geänderte Flächen annehmen</translation>
  </message>
  <message>
   <source>The faces of the selected tolerances are the right ones</source>
   <translation>Die Flächen der gewählten Toleranzen sind die richtigen</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_AddDatum</name>
  <message>
   <source>Add datum</source>
   <translation>Bezug anlegen</translation>
  </message>
  <message>
   <source>Make the faces that are picked a datum</source>
   <translation>Die gewählten Flächen zum Bezug machen</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_AddTolerance</name>
  <message>
   <source>Add a tolerance to the faces that are picked</source>
   <translation>Den gewählten Flächen eine Toleranz geben</translation>
  </message>
  <message>
   <source>Add tolerance</source>
   <translation>Toleranz anlegen</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_Cancel</name>
  <message>
   <source>Cancel</source>
   <translation>Abbrechen</translation>
  </message>
  <message>
   <source>Cancel the computation of the skin model</source>
   <translation>Die Berechnung des Hautmodells abbrechen</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_Check</name>
  <message>
   <source>Check against tolerances</source>
   <translation>Gegen Toleranzen prüfen</translation>
  </message>
  <message>
   <source>Evaluate the tolerances as they are now on the parts that were drawn</source>
   <translation>Die Toleranzen von jetzt an den gezogenen Teilen auswerten</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_ColorMap</name>
  <message>
   <source>Colours and legend...</source>
   <translation>Farben und Legende...</translation>
  </message>
  <message>
   <source>Range, bands, palette and legend of the deviation map</source>
   <translation>Bereich, Stufen, Palette und Legende des Abweichungsbilds</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_Compute</name>
  <message>
   <source>Compute</source>
   <translation>Berechnen</translation>
  </message>
  <message>
   <source>Compute the skin model in the background</source>
   <translation>Das Hautmodell im Hintergrund berechnen</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_CreateSkin</name>
  <message>
   <source>Create a model of the part as it could be made</source>
   <translation>Ein Modell des Teils anlegen, wie es gefertigt sein könnte</translation>
  </message>
  <message>
   <source>Create skin model</source>
   <translation>Hautmodell anlegen</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_DeviationMap</name>
  <message>
   <source>Deviation map on/off</source>
   <translation>Abweichungsbild an/aus</translation>
  </message>
  <message>
   <source>Show the deviations as colours, or the plain mesh</source>
   <translation>Die Abweichungen als Farben zeigen, oder das bloße Netz</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_Exaggeration</name>
  <message>
   <source>Draw deviations up to 1000 times larger</source>
   <translation>Abweichungen bis zu 1000-fach vergrößert zeichnen</translation>
  </message>
  <message>
   <source>Exaggeration...</source>
   <translation>Überhöhung...</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_Export</name>
  <message>
   <source>Export mesh...</source>
   <translation>Netz ausgeben...</translation>
  </message>
  <message>
   <source>Write the part that is shown to a mesh file</source>
   <translation>Das gezeigte Teil in eine Netzdatei schreiben</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_FindFaces</name>
  <message>
   <source>Find moved faces</source>
   <translation>Verschobene Flächen finden</translation>
  </message>
  <message>
   <source>Put the selected tolerances back on the faces that were picked</source>
   <translation>Die gewählten Toleranzen wieder auf die gewählten Flächen setzen</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_GeneralTolerance</name>
  <message>
   <source>General tolerance...</source>
   <translation>Allgemeintoleranz...</translation>
  </message>
  <message>
   <source>Set the tolerance of all faces that have none of their own</source>
   <translation>Die Toleranz aller Flächen ohne eigene setzen</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_ImportStep</name>
  <message>
   <source>Import STEP with tolerances...</source>
   <translation>STEP mit Toleranzen importieren...</translation>
  </message>
  <message>
   <source>Import a STEP file with the tolerances and datums that it holds (AP242)</source>
   <translation>Eine STEP-Datei mit ihren Toleranzen und Bezügen importieren (AP242)</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_Probe</name>
  <message>
   <source>A click on the skin model shows the deviation there; again, or Escape, ends it</source>
   <translation>Ein Klick auf das Hautmodell zeigt dort die Abweichung; nochmals, oder Escape, beendet es</translation>
  </message>
  <message>
   <source>Probe value</source>
   <translation>Wert ablesen</translation>
  </message>
 </context>
 <context>
  <name>CadSkin_Sample</name>
  <message>
   <source>Draw several parts, go through them, see how their values spread</source>
   <translation>Mehrere Teile ziehen, durchgehen, die Streuung ihrer Werte sehen</translation>
  </message>
  <message>
   <source>Sample several instances</source>
   <translation>Mehrere Teile ziehen</translation>
  </message>
 </context>
</TS>
